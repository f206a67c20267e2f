// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/calibration_doubts.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace calibration_doubts_test {

StereoRig rig() {
  const MountedCamera camera{Camera(PinholeRadtan{400, 400, 320, 240}, 640, 480), {}};
  MountedCamera other = camera;
  other.T_BC.p = Vec3(0.1, 0, 0);
  return with_cameras({}, {camera, other});
}

/// The only doubt.
std::string doubt(const StereoRig& of) {
  const std::vector<std::string> all = calibration_doubts(of);
  return all.size() == 1 ? all[0] : std::to_string(all.size()) + " doubts";
}

TEST(CalibrationDoubts, ASensorInUseHasNone) {
  EXPECT_TRUE(calibration_doubts(rig()).empty());
  StereoRig inflated = rig();  // by ten, as many do
  inflated.imu_noise.gyro_noise_density_radps_rthz *= 10, inflated.imu_noise.accel_noise_density_mps2_rthz *= 10;
  inflated.time_offset_s = -0.1, inflated.line_delay_s = 60e-6;
  EXPECT_TRUE(calibration_doubts(inflated).empty());
}

TEST(CalibrationDoubts, OtherUnitsAreAskedAbout) {
  StereoRig r = rig();
  r.cameras[1].camera.set_own_times({-4.5, 0});
  EXPECT_NE(doubt(r).find("camera 1's time offset is -4.5 s: is it in milliseconds"), std::string::npos) << doubt(r);
  r = rig();
  r.line_delay_s = -3e-5;
  EXPECT_NE(doubt(r).find("camera 0's line delay is negative"), std::string::npos) << "once for all that have it";
  r = rig();
  r.line_delay_s = 35;
  EXPECT_NE(doubt(r).find("is it in microseconds"), std::string::npos) << doubt(r);
  for (const double factor : {1e-3, 1e3}) {
    r = rig();
    r.imu_noise.gyro_noise_density_radps_rthz *= factor;
    EXPECT_NE(doubt(r).find("gyroscope's noise density"), std::string::npos) << doubt(r);
    r = rig();
    r.imu_noise.accel_noise_density_mps2_rthz *= factor;
    EXPECT_NE(doubt(r).find("accelerometer's noise density"), std::string::npos) << doubt(r);
  }
}

TEST(CalibrationDoubts, ExchangedSensorsAreAskedAbout) {
  StereoRig r = rig();
  std::swap(r.imu_noise.gyro_noise_density_radps_rthz, r.imu_noise.accel_noise_density_mps2_rthz);
  EXPECT_NE(doubt(r).find("are they exchanged?"), std::string::npos) << doubt(r);
}

}  // namespace calibration_doubts_test
}  // namespace fbvins
