// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "fbvins/calibration/imu_camera_scene.hpp"

namespace fbvins {
namespace {

using test::hand_held;
using test::HandHeldOptions;
using test::HandHeldRecording;

TEST(ImuCamera, FindsWhatWasPutIn) {
  const HandHeldRecording r = hand_held({}, 1);
  const Result<CameraImuResult> found = calibrate_imu_camera(r.input, {});
  ASSERT_TRUE(found) << found.error().message;
  for (std::size_t c = 0; c < 2; ++c) {
    const Vec3 dp = found->cameras[c].T_BC.p - r.truth.T_BC[c].p;
    const Vec3 dq = so3_log(r.truth.T_BC[c].q.conjugate() * found->cameras[c].T_BC.q);
    fmt::print("{} mm {} deg\n", 1e3 * dp.norm(), 57.3 * dq.norm());
  }
  fmt::print("td {} ms\n", 1e3 * (found->time_offset_s - r.truth.time_offset_s));
  for (auto& p : found->parameters) fmt::print("{} {} +- {} {}\n", p.name, p.value, p.sigma, p.unit);
  fmt::print("{} it, {} px, gyro {} accel {} g {} +- {} scale {} +- {} knots {}\n", found->iterations, found->corner_sigma_px,
             found->gyro_rms_sigmas, found->accel_rms_sigmas, found->measured_gravity_mps2, found->measured_gravity_sigma_mps2,
             found->board_scale, found->board_scale_sigma, found->knot_spacing_s);
}

}  // namespace
}  // namespace fbvins
