// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/calibration_files.hpp"

#include <gtest/gtest.h>

#include "fbvins/calibration/simulated_board.hpp"
#include "fbvins/io/calibration.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins {
namespace calibration_files_test {

RigCalibration rig_with(const Camera& camera) {
  const SimulatedRig simulated = simulated_stereo(camera);
  RigCalibration rig{simulated.cameras, simulated.T_CnC0, {}, 0.0123456789, {}};
  const Pose<B, Cn> T_BC0(so3_exp(Vec3(0.3, -1.2, 0.9)), Vec3(0.02, -0.03, 0.05));
  const Pose<B, C0> same(T_BC0.q, T_BC0.p);
  rig.T_BC = {T_BC0, same * rig.T_CnC0[1].inverse()};
  rig.imu_noise.gyro_noise_density_radps_rthz = 1.23456789e-4;
  return rig;
}

TEST(CalibrationFiles, WhatIsWrittenForKalibrIsReadBack) {
  for (const Camera& camera : example_cameras()) {
    const RigCalibration rig = rig_with(camera);
    const auto read = parse_kalibr_camchain({"camchain-imucam.yaml", to_kalibr_camchain(rig)});
    ASSERT_TRUE(read) << camera.model_name() << ": " << read.error().message;
    EXPECT_EQ(read->left().model_name(), camera.model_name());
    EXPECT_EQ(read->left().width(), camera.width());
    EXPECT_EQ(lens_parameters(read->left().model()), lens_parameters(rig.cameras[0].model()));
    EXPECT_EQ(lens_parameters(read->right().model()), lens_parameters(rig.cameras[1].model()));
    EXPECT_LT((read->T_BC0().p - rig.T_BC[0].p).norm() + (read->T_BC1().p - rig.T_BC[1].p).norm(), 1e-12);
    EXPECT_LT(so3_log(read->T_BC1().q.conjugate() * rig.T_BC[1].q).norm(), 1e-12);
    EXPECT_EQ(read->time_offset_s, rig.time_offset_s);
  }
}

TEST(CalibrationFiles, ARigInOneFileIsReadBack) {
  const RigCalibration written = rig_with(example_cameras()[0]);
  StereoRig rig = with_cameras({}, {{written.cameras[0], written.T_BC[0].cast_frames<B, C0>()},
                                    {written.cameras[1], written.T_BC[1].cast_frames<B, C0>()}});
  rig.imu_noise = {1.5e-3, 2.5e-2, 3.5e-5, 4.5e-3, 400, 8, 80};
  rig.imu_noise.axes.accel << 1.01, 0.002, 0, -0.004, 0.99, 0.001, 0.003, 0, 1.02;
  rig.time_offset_s = -0.0123, rig.line_delay_s = 3e-5;
  rig.cameras[1].camera.set_own_times({0.002, 1e-5});
  rig.imu_noise.axes.gyro(0, 0) = 1.0078125, rig.imu_noise.axes.accel(2, 1) = 0.015625;
  const std::string text = to_kalibr_rig(rig_calibration(rig));
  const auto read = parse_kalibr_camchain({"fixed.yaml", text});
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_LT((read->T_BC0().p - rig.T_BC0().p).norm() + (read->T_BC1().p - rig.T_BC1().p).norm(), 1e-12);
  EXPECT_EQ(read->time_offset_s, rig.time_offset_s);
  EXPECT_EQ(read->line_delay_s, rig.line_delay_s);
  EXPECT_DOUBLE_EQ(read->times(1).time_offset_s, -0.0103);
  EXPECT_DOUBLE_EQ(read->times(1).line_delay_s, 4e-5);
  const auto noise = parse_imu({"fixed.yaml", text});
  ASSERT_TRUE(noise) << noise.error().message;
  EXPECT_EQ(noise->gyro_noise_density_radps_rthz, 1.5e-3);
  EXPECT_EQ(noise->accel_random_walk_mps3_rthz, 4.5e-3);
  EXPECT_EQ(noise->rate_hz, 400);
  EXPECT_LT((noise->axes.gyro - rig.imu_noise.axes.gyro).norm() + (noise->axes.accel - rig.imu_noise.axes.accel).norm(), 1e-12);
  EXPECT_EQ(noise->max_gyro_radps, 8);
  EXPECT_EQ(noise->max_accel_mps2, 80);
  EXPECT_LT((noise->axes.accel - rig.imu_noise.axes.accel).norm(), 1e-12);
}

TEST(CalibrationFiles, ARollingShutterThatIsFoundIsWritten) {
  const RigCalibration rig = rig_with(example_cameras()[0]);
  CameraCalibration cameras;
  CameraImuResult imu;
  for (std::size_t k = 0; k < 2; ++k) {
    CalibratedCamera& camera = cameras.cameras.emplace_back();
    camera.camera = rig.cameras[k], camera.T_CnC0 = rig.T_CnC0[k];
    CameraOnImu& mounted = imu.cameras.emplace_back();
    mounted.T_BC = rig.T_BC[k], mounted.later_s = k == 0 ? 0 : 0.002;
  }
  imu.time_offset_s = 0.0123, imu.line_delay_s = 4.1e-5;
  const RigCalibration found = rig_calibration(cameras, imu, {});
  for (const std::string& text : {to_kalibr_camchain(found), to_kalibr_rig(found)}) {
    const auto read = parse_kalibr_camchain({"camchain-imucam.yaml", text});
    ASSERT_TRUE(read) << read.error().message;
    for (int k = 0; k < 2; ++k) EXPECT_DOUBLE_EQ(read->times(k).line_delay_s, 4.1e-5);
    EXPECT_DOUBLE_EQ(read->times(0).time_offset_s, 0.0123);
    EXPECT_DOUBLE_EQ(read->times(1).time_offset_s, 0.0143);
  }
}

/// Kalibr's reader (kalibr_common/ConfigReader.py) asks for as many coefficients as the model has, and for floating point
/// numbers.
TEST(CalibrationFiles, KalibrsReaderTakesWhatIsWritten) {
  const Camera round(DoubleSphere{400, 401, 320, 240, 1e-4, 0.5}, 640, 480);
  const std::string text = to_kalibr_camchain(rig_with(round));
  EXPECT_NE(text.find("distortion_coeffs: []\n  distortion_model: none\n"), std::string::npos) << text;
  EXPECT_NE(text.find("intrinsics: [0.0001, 0.5, 400.0, 401.0, 320.0, 240.0]"), std::string::npos) << text;
  EXPECT_NE(to_kalibr_camchain(rig_with(example_cameras()[0])).find("distortion_coeffs: [-0.28"), std::string::npos);
  ImuNoise noise;
  noise.gyro_random_walk_radps2_rthz = 0x1p-20, noise.accel_noise_density_mps2_rthz = 1;
  const std::string imu = to_kalibr_imu(noise);
  EXPECT_NE(imu.find("gyroscope_random_walk: 9.5367431640625e-07\n"), std::string::npos) << imu;
  EXPECT_NE(imu.find("accelerometer_noise_density: 1.0\n"), std::string::npos) << imu;
}

TEST(CalibrationFiles, TheSecondCameraIsAlsoFoundThroughTheFirst) {
  const RigCalibration rig = rig_with(example_cameras()[0]);
  std::string text = to_kalibr_camchain(rig);
  const std::size_t second = text.find("T_cam_imu", text.find("cam1:"));
  text.replace(second, 9, "T_ignored");  // then T_cn_cnm1 counts
  const auto read = parse_kalibr_camchain({"camchain-imucam.yaml", text});
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_LT((read->T_BC1().p - rig.T_BC[1].p).norm(), 1e-12);
}

TEST(CalibrationFiles, NoiseOfTheImuIsReadBack) {
  const RigCalibration rig = rig_with(example_cameras()[0]);
  const auto read = parse_imu({"imu.yaml", to_kalibr_imu(rig.imu_noise)});
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->gyro_noise_density_radps_rthz, rig.imu_noise.gyro_noise_density_radps_rthz);
  EXPECT_EQ(read->rate_hz, rig.imu_noise.rate_hz);
}

TEST(CalibrationFiles, ModelsThatAFormatDoesNotKnowAreRefused) {
  EXPECT_FALSE(to_basalt(rig_with(example_cameras()[4])));
  EXPECT_TRUE(to_basalt(rig_with(example_cameras()[2])));
  EXPECT_FALSE(to_ros_camera_info(rig_with(example_cameras()[2]), 0));
  EXPECT_TRUE(to_ros_camera_info(rig_with(example_cameras()[1]), 0));
}

}  // namespace calibration_files_test
}  // namespace fbvins
