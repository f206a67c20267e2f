// SPDX-License-Identifier: Apache-2.0
// What `fbvins calibrate` writes for other programs, read as --calibration reads it.
#include <gtest/gtest.h>

#include <fstream>

#include "fbvins/bags/calibration.hpp"
#include "fbvins/calibration/calibration_files.hpp"
#include "fbvins/calibration/simulated_board.hpp"
#include "tests/support/test_files.hpp"

namespace fbvins::app {
namespace calibration_formats_test {

/// Three cameras of a kind on an IMU.
RigCalibration three_cameras(const Camera& camera) {
  const SimulatedRig pair = simulated_stereo(camera);
  RigCalibration rig{pair.cameras, pair.T_CnC0, {}, -0.0123456789, {1.5e-3, 2.5e-2, 3.5e-5, 4.5e-3, 400}};
  rig.cameras.push_back(camera);
  rig.T_CnC0.emplace_back(so3_exp(Vec3(0.1, 3.0, -0.2)), Vec3(0.05, 0.02, -0.3));
  const Pose<B, C0> T_BC0(so3_exp(Vec3(0.3, -1.2, 0.9)), Vec3(0.02, -0.03, 0.05));
  for (const Pose<Cn, C0>& T : rig.T_CnC0) rig.T_BC.push_back(T_BC0 * T.inverse());
  return rig;
}

TEST(CalibrationFormats, WhatIsWrittenForBasaltIsReadBack) {
  const test::Folder folder("formats");
  const std::string path = folder.path() + "/calibration.json";
  for (const Camera& camera : example_cameras()) {
    const RigCalibration rig = three_cameras(camera);
    const Result<std::string> text = to_basalt(rig);
    if (camera.model_name() == "omni-radtan") {
      EXPECT_FALSE(text);
      continue;
    }
    ASSERT_TRUE(text) << camera.model_name();
    std::ofstream(path) << *text;
    const Result<StereoRig> read = load_calibration(path);
    ASSERT_TRUE(read) << camera.model_name() << ": " << read.error().message;
    ASSERT_EQ(read->camera_count(), 3);
    for (int k = 0; k < 3; ++k) {
      const Camera& written = rig.cameras[static_cast<std::size_t>(k)];
      const Pose<B, Cn>& T_BC = rig.T_BC[static_cast<std::size_t>(k)];
      EXPECT_EQ(read->camera(k).model_name(), written.model_name());
      EXPECT_EQ(lens_parameters(read->camera(k).model()), lens_parameters(written.model())) << written.model_name() << k;
      EXPECT_EQ(read->camera(k).width(), written.width());
      EXPECT_EQ(read->camera(k).height(), written.height());
      EXPECT_LT((read->T_BC(k).p - T_BC.p).norm(), 1e-12);
      EXPECT_LT(so3_log(read->T_BC(k).q.conjugate() * T_BC.q).norm(), 1e-12);
    }
    EXPECT_NEAR(read->time_offset_s, rig.time_offset_s, 0.5e-9) << "whole nanoseconds";
    EXPECT_EQ(read->imu_noise.gyro_noise_density_radps_rthz, 1.5e-3);
    EXPECT_EQ(read->imu_noise.accel_noise_density_mps2_rthz, 2.5e-2);
    EXPECT_EQ(read->imu_noise.gyro_random_walk_radps2_rthz, 3.5e-5);
    EXPECT_EQ(read->imu_noise.accel_random_walk_mps3_rthz, 4.5e-3);
    EXPECT_EQ(read->imu_noise.rate_hz, 400);
  }
}

}  // namespace calibration_formats_test
}  // namespace fbvins::app
