// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/imu.hpp"

#include <Eigen/LU>

namespace fbvins {

bool ImuIntrinsics::operator==(const ImuIntrinsics& o) const {
  return gyro == o.gyro && accel == o.accel && gyro_by_force == o.gyro_by_force && bias.gyro_radps == o.bias.gyro_radps &&
         bias.accel_mps2 == o.bias.accel_mps2;
}

ImuSample corrected(const ImuSample& reading, const ImuIntrinsics& axes) {
  if (axes == ImuIntrinsics{}) return reading;
  const Vec3 force = axes.accel.inverse() * (reading.accel_mps2 - axes.bias.accel_mps2);
  return {reading.t, axes.gyro.inverse() * (reading.gyro_radps - axes.bias.gyro_radps - axes.gyro_by_force * force), force};
}

ImuIntrinsics followed_by(const ImuIntrinsics& given, const ImuIntrinsics& found) {
  ImuIntrinsics out;
  out.gyro = given.gyro * found.gyro;
  out.accel = given.accel * found.accel;
  out.gyro_by_force = given.gyro * found.gyro_by_force + given.gyro_by_force * found.accel;
  out.bias.gyro_radps = given.gyro * found.bias.gyro_radps + given.gyro_by_force * found.bias.accel_mps2 + given.bias.gyro_radps;
  out.bias.accel_mps2 = given.accel * found.bias.accel_mps2 + given.bias.accel_mps2;
  return out;
}

}  // namespace fbvins
