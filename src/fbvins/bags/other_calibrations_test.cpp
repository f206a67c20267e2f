// SPDX-License-Identifier: Apache-2.0
// Calibrations of VINS-Mono, ORB-SLAM3, an OAK and Kimera-VIO, and files that are something else.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "fbvins/bags/calibration.hpp"
#include "fbvins/bags/foreign_calibration.hpp"

namespace fbvins {
namespace other_calibrations_test {

namespace fs = std::filesystem;

const Pose<B, C0> kLeft(so3_exp({0.1, -0.2, 1.5}), {0.01, -0.02, 0.03});
const Pose<B, C0> kRight = kLeft * Pose<C0, C0>(so3_exp({0.01, 0.02, -0.01}), Vec3(0.11, 0.001, 0.002));

std::string rows(const Mat3& R) {
  return fmt::format("[{:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}]", R(0, 0), R(0, 1),
                     R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2));
}

template <class P>
std::string matrix(const P& T) {
  std::string out;
  const Mat3 R = T.R();
  for (int i = 0; i < 3; ++i) out += fmt::format("{:.17g}, {:.17g}, {:.17g}, {:.17g}, ", R(i, 0), R(i, 1), R(i, 2), T.p(i));
  return "{rows: 4, cols: 4, data: [" + out + "0, 0, 0, 1]}";
}

template <class P, class Q>
void expect_same(const P& a, const Q& b) {
  EXPECT_LT((a.p - b.p).norm(), 1e-9);
  EXPECT_LT((a.R() - b.R()).norm(), 1e-9);
}

std::string message(const Result<StereoRig>& read) { return read ? "read" : read.error().message; }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

std::string vins_mono() {
  return "%YAML:1.0\n\nimu_topic: \"/imu0\"\nmodel_type: PINHOLE\nimage_width: 752\nimage_height: 480\ndistortion_parameters:\n"
         "   k1: -0.28\n   k2: 0.07\n   p1: 0\n   p2: 0\nprojection_parameters:\n   fx: 460\n   fy: 461\n   cx: 370\n   cy: 240\n"
         "estimate_extrinsic: 0\nextrinsicRotation: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: " +
         rows(kLeft.R()) +
         "\nextrinsicTranslation: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [0.01, -0.02, 0.03]\n"
         "acc_n: 0.08\ngyr_n: 0.004\nacc_w: 0.00004\ngyr_w: 2.0e-6\ntd: 0.01\nrolling_shutter: 0\nrolling_shutter_tr: 0.024\n";
}

TEST(OtherCalibrations, VinsMono) {
  const auto rig = parse_vins_mono({"v.yaml", vins_mono()});
  ASSERT_TRUE(rig) << rig.error().message;
  expect_same(rig->T_BC0(), kLeft);
  EXPECT_FALSE(rig->has_right());
  EXPECT_NEAR(rig->imu_noise.accel_noise_density_mps2_rthz, 0.08 / std::sqrt(200), 1e-12);
  EXPECT_EQ(rig->time_offset_s, 0.01);
  EXPECT_EQ(rig->line_delay_s, 0);
  const auto rolling = parse_vins_mono({"v.yaml", replaced(vins_mono(), "rolling_shutter: 0", "rolling_shutter: 1")});
  EXPECT_NEAR(rolling->line_delay_s, 0.024 / 480, 1e-15);
  EXPECT_NEAR(rolling->time_offset_s, 0.01 + 0.012, 1e-12);
  const std::string unknown = replaced(vins_mono(), "extrinsicRotation", "extrinsicTurn");
  EXPECT_NE(message(parse_vins_mono({"v.yaml", unknown})).find("extrinsicRotation: is missing: the camera's place"),
            std::string::npos);
}

std::string orbslam() {
  return "%YAML:1.0\n\nFile.version: \"1.0\"\nCamera.type: \"PinHole\"\nCamera1.fx: 458.6\nCamera1.fy: 457.2\nCamera1.cx: 367.2\n"
         "Camera1.cy: 248.3\nCamera1.k1: -0.28\nCamera1.k2: 0.07\nCamera1.p1: 0.0002\nCamera1.p2: 1.7e-05\nCamera2.fx: 457.5\n"
         "Camera2.fy: 456.1\nCamera2.cx: 379.9\nCamera2.cy: 255.2\nCamera2.k1: -0.28\nCamera2.k2: 0.07\nCamera.width: 752\n"
         "Camera.height: 480\nStereo.T_c1_c2: !!opencv-matrix " +
         matrix(kLeft.inverse() * kRight) + "\nIMU.T_b_c1: !!opencv-matrix " + matrix(kLeft) +
         "\nIMU.NoiseGyro: 1.7e-04\nIMU.NoiseAcc: 2.0e-03\nIMU.GyroWalk: 1.9393e-05\nIMU.AccWalk: 3.e-03\nIMU.Frequency: 200.0\n";
}

TEST(OtherCalibrations, OrbSlam) {
  const auto rig = parse_orbslam({"o.yaml", orbslam()});
  ASSERT_TRUE(rig) << rig.error().message;
  expect_same(rig->T_BC0(), kLeft);
  expect_same(rig->T_BC1(), kRight);
  EXPECT_EQ(rig->right().intrinsics()[0], 457.5);
  EXPECT_EQ(rig->left().distortion(), (std::vector{-0.28, 0.07, 0.0002, 1.7e-05}));
  EXPECT_EQ(rig->imu_noise.accel_noise_density_mps2_rthz, 2e-3);
  const std::string with_k3 = orbslam() + "Camera1.k3: -0.01\n";
  EXPECT_EQ(parse_orbslam({"o.yaml", with_k3})->left().model_name(), "pinhole-radtan5");
  EXPECT_NE(message(parse_orbslam({"o.yaml", replaced(orbslam(), "IMU.T_b_c1", "IMU.T")})).find("the camera's place on the IMU"),
            std::string::npos);
  EXPECT_NE(
      message(parse_orbslam({"o.yaml", replaced(orbslam(), "PinHole", "Scaramuzza")})).find("'Scaramuzza' is not supported"),
      std::string::npos);
}

TEST(OtherCalibrations, OrbSlamsOlderFilesOfARectifiedPair) {
  const std::string older =
      "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera.fx: 435.2\nCamera.fy: 435.2\nCamera.cx: 367.4\nCamera.cy: 252.2\nCamera.k1: 0.0\n"
      "Camera.k2: 0.0\nCamera.p1: 0.0\nCamera.p2: 0.0\nCamera.width: 752\nCamera.height: 480\nCamera.bf: 43.52\nTbc: !!opencv-matrix " +
      matrix(kLeft) +
      "\nIMU.NoiseGyro: 1.7e-04\nIMU.NoiseAcc: 2.0e-03\nIMU.GyroWalk: 1.9e-05\nIMU.AccWalk: 3.e-03\nIMU.Frequency: 200\n";
  const auto rig = parse_orbslam({"o.yaml", older});
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_LT((rig->T_BC1().p - kLeft * Vec3(0.1, 0, 0)).norm(), 1e-12);
  EXPECT_FALSE(parse_orbslam({"o.yaml", older + "DepthMapFactor: 1000.0\n"})->has_right())
      << "a depth camera's bf is no second camera";
}

std::string oak() {
  const auto place = [](const Pose<C0, C0>& T, int to) {
    return fmt::format(
        R"({{"rotationMatrix": {}, "translation": {{"x": {:.17g}, "y": {:.17g}, "z": {:.17g}}}, "toCameraSocket": {}}})",
        rows(T.R()), 100 * T.p.x(), 100 * T.p.y(), 100 * T.p.z(), to);
  };
  const auto camera = [&](int socket, const Pose<C0, C0>& T, int to) {
    return fmt::format(
        R"([{}, {{"cameraType": 0, "width": 1280, "height": 800, "intrinsicMatrix": [[800, 0, 640], [0, 801, 400], [0, 0, 1]],
 "distortionCoeff": [0.52, -2.44, 0.0004, -0.0001, 1.42, 0.4, -2.26, 1.35, 0, 0, 0, 0, 0, 0], "extrinsics": {}}}])",
        socket, place(T, to));
  };
  const Pose<C0, C0> T_RL = kRight.inverse() * kLeft, T_AR(so3_exp({0.01, 0, 0}), Vec3(-0.0375, 0, 0));
  const Pose<C0, B> T_AB = T_AR * kRight.inverse();
  return R"({"cameraData": [)" + camera(1, T_RL, 2) + ", " + camera(2, T_AR, 0) + ", " + camera(0, {}, -1) +
         R"(], "imuExtrinsics": )" + place(Pose<C0, C0>(T_AB.q, T_AB.p), 0) +
         R"(, "stereoRectificationData": {"leftCameraSocket": 1, "rightCameraSocket": 2}})";
}

TEST(OtherCalibrations, Oak) {
  const auto rig = parse_oak({"oak.json", oak()});
  ASSERT_TRUE(rig) << rig.error().message;
  expect_same(rig->T_BC0(), kLeft);
  expect_same(rig->T_BC1(), kRight);
  EXPECT_EQ(rig->left().model_name(), "pinhole-rational");
  const std::string without = replaced(oak(), R"("toCameraSocket": 0}, "stereo)", R"("toCameraSocket": -1}, "stereo)");
  EXPECT_NE(message(parse_oak({"oak.json", without})).find("the device's IMU has no place"), std::string::npos);
  EXPECT_NE(message(parse_oak({"oak.json", "{\"cameraData\": []}"})), "read");
}

class Files : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  fs::path folder_ = fs::temp_directory_path() / fmt::format("fbvins_other_calibrations_{}", ::getpid());
};
using OtherCalibrationFiles = Files;

std::string kimera(const std::string& id, const Pose<B, C0>& T) {
  return "%YAML:1.0\ncamera_id: " + id + "\nT_BS: " + matrix(T) +
         "\nrate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\nintrinsics: [458.6, 457.2, 367.2, 248.3]\n"
         "distortion_model: radial-tangential\ndistortion_coefficients: [-0.28, 0.07, 0, 0]\n";
}

TEST_F(OtherCalibrationFiles, KimerasAreThreeBesideOneAnother) {
  const std::string left = write("LeftCameraParams.yaml", kimera("left_cam", kLeft));
  auto rig = load_calibration(left);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_FALSE(rig->has_right());
  const std::string right = write("RightCameraParams.yaml", kimera("right_cam", kRight));
  write("ImuParams.yaml",
        "rate_hz: 200\ngyroscope_noise_density: 0.0002\ngyroscope_random_walk: 0.00002\naccelerometer_noise_density: 0.003\n"
        "accelerometer_random_walk: 0.004\nimu_time_shift: 0.005\n");
  for (const std::string& given : {left, right}) {
    rig = load_calibration(given);
    ASSERT_TRUE(rig) << rig.error().message;
    expect_same(rig->T_BC0(), kLeft);
    expect_same(rig->T_BC1(), kRight);
    EXPECT_EQ(rig->imu_noise.accel_noise_density_mps2_rthz, 0.003);
    EXPECT_EQ(rig->time_offset_s, -0.005);
  }
}

TEST_F(OtherCalibrationFiles, AreReadByContentOrNamed) {
  EXPECT_TRUE(load_calibration(write("a.yaml", vins_mono())));
  EXPECT_TRUE(load_calibration(write("b.yaml", orbslam())));
  EXPECT_TRUE(load_calibration(write("c.json", oak())));
  const std::string info =
      "image_width: 1280\nimage_height: 720\ncamera_matrix: {data: [653, 0, 652, 0, 653, 361, 0, 0, 1]}\ndistortion_model: plumb_bob\n"
      "distortion_coefficients: {data: [-0.05, 0.056, -0.0008, 0.0013, -0.0187]}\n"
      "rectification_matrix: {data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\nprojection_matrix: {data: [653, 0, 652, 0, 0, 653, 361, 0, 0, 0, 1, 0]}\n";
  const std::string said = message(load_calibration(write("d.yaml", info)));
  EXPECT_NE(said.find("camera_info file of ROS"), std::string::npos) << said;
  EXPECT_NE(said.find("distortion_model: plumb_bob, distortion_coeffs: [-0.05"), std::string::npos) << said;
  const std::pair<const char*, const char*> named[] = {
      {"Gyr:\n  avg-axis: {gyr_n: 1}\nAcc:\n  avg-axis: {acc_n: 1}\n", "imu_utils"},
      {"cameras:\n - {T_SC: [1], image_dimension: [6, 4], focal_length: [1, 1]}\n", "OKVIS"},
      {"target_type: aprilgrid\n", "--target"},
      {"model_type: MEI\nmirror_parameters:\n  xi: 1\nprojection_parameters:\n  u0: 1\n", "camodocal"},
      {"{\"imus\": [{\"accelerometer\": {\"scale_and_alignment\": [1]}}]}", "RealSense's IMU"},
      {"[LEFT_CAM_HD]\nfx=700\n", "ZED"}};
  for (const auto& [text, word] : named) {
    const std::string sentence = message(load_calibration(write("e.yaml", text)));
    EXPECT_NE(sentence.find(word), std::string::npos) << sentence;
    EXPECT_EQ(sentence.find("cam0"), std::string::npos) << sentence;
  }
}

}  // namespace other_calibrations_test
}  // namespace fbvins
