// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/foreign_calibration.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "fbvins/bags/calibration.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins {
namespace foreign_calibration_test {

const Pose<B, C0> kLeft(so3_exp({0.1, -0.2, 1.5}), {0.01, -0.02, 0.03});
const Pose<B, C1> kRight(so3_exp({0.12, -0.19, 1.49}), {0.01, 0.09, 0.03});

template <class P, class Q>
void expect_same(const P& a, const Q& b) {
  EXPECT_LT((a.p - b.p).norm(), 1e-12);
  EXPECT_LT((a.R() - b.R()).norm(), 1e-12);
}

void expect_rig(const Result<StereoRig>& rig) {
  ASSERT_TRUE(rig) << rig.error().message;
  expect_same(rig->T_BC0(), kLeft);
  expect_same(rig->T_BC1(), kRight);
  EXPECT_EQ(rig->left().width(), 752);
  EXPECT_EQ(rig->right().height(), 480);
}

std::string numbers(const auto& pose) {
  const Mat3 R = pose.R();
  std::string out;
  for (int i = 0; i < 3; ++i)
    out += fmt::format("{}{:.17g}, {:.17g}, {:.17g}, {:.17g}", i > 0 ? ", " : "", R(i, 0), R(i, 1), R(i, 2), pose.p(i));
  return out + ", 0, 0, 0, 1";
}

std::string openvins_camera(const auto& pose) {
  return "  T_imu_cam: [" + numbers(pose) +
         "]\n  camera_model: pinhole\n  distortion_coeffs: [0.1, 0.2, 0.003, 0.004]\n  distortion_model: radtan\n"
         "  intrinsics: [458.6, 457.2, 367.2, 248.3]\n  resolution: [752, 480]\n  timeshift_cam_imu: -0.004\n";
}

std::string basalt(const std::string& model = "kb4") {
  const auto pose = [](const auto& T) {
    return fmt::format(
        R"({{"px": {:.17g}, "py": {:.17g}, "pz": {:.17g}, "qx": {:.17g}, "qy": {:.17g}, "qz": {:.17g}, "qw": {:.17g}}})", T.p.x(),
        T.p.y(), T.p.z(), T.q.x(), T.q.y(), T.q.z(), T.q.w());
  };
  const std::string camera =
      R"({"camera_type": ")" + model +
      R"(", "intrinsics": {"fx": 380.5, "fy": 380.25, "cx": 376, "cy": 240, "k1": 0.01, "k2": 0.02, "k3": -0.03, "k4": 0.004}})";
  return R"({"value0": {"T_imu_cam": [)" + pose(kLeft) + ", " + pose(kRight) + R"(], "intrinsics": [)" + camera + ", " + camera +
         R"(], "resolution": [[752, 480], [752, 480]], "cam_time_offset_ns": 2000000, "imu_update_rate": 200.0,
 "accel_noise_std": [0.016, 0.015, 0.016], "gyro_noise_std": [0.000282, 0.000282, 0.000282],
 "accel_bias_std": [0.001, 0.001, 0.001], "gyro_bias_std": [0.0001, 0.0001, 0.0001]}})";
}

const std::string kPinhole =
    "%YAML:1.0\n---\nmodel_type: PINHOLE\ncamera_name: camera\nimage_width: 752\nimage_height: 480\ndistortion_parameters:\n   k1: -2.8e-01\n"
    "   k2: 7.4e-02\n   p1: 1.9e-04\n   p2: 1.7e-05\nprojection_parameters:\n   fx: 4.6e+02\n   fy: 4.5e+02\n   cx: 3.6e+02\n   cy: 2.4e+02\n";
const std::string kFisheye =
    "%YAML:1.0\n---\nmodel_type: KANNALA_BRANDT\ncamera_name: camera\nimage_width: 752\nimage_height: 480\nprojection_parameters:\n   k2: -0.01\n"
    "   k3: 0.02\n   k4: -0.03\n   k5: 0.04\n   mu: 380\n   mv: 381\n   u0: 370\n   v0: 240\n";

std::string vins_fusion() {
  const auto matrix = [](const char* name, const auto& pose) {
    return fmt::format("{}: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [{}]\n", name, numbers(pose));
  };
  return "%YAML:1.0\nimu: 1\nnum_of_cam: 2\ncam0_calib: \"left.yaml\"\ncam1_calib: \"right.yaml\"\n" +
         matrix("body_T_cam0", kLeft) + matrix("body_T_cam1", kRight) +
         "acc_n: 0.1\ngyr_n: 0.01\nacc_w: 0.001\ngyr_w: 0.0001\ntd: 0.002\n";
}

TEST(ForeignCalibration, OpenVinsHasCamerasInTheImu) {
  const auto rig = parse_openvins_cameras(
      {"chain.yaml", "%YAML:1.0\n\ncam0:\n" + openvins_camera(kLeft) + "cam1:\n" + openvins_camera(kRight)});
  expect_rig(rig);
  EXPECT_EQ(rig->time_offset_s, -0.004);
  EXPECT_EQ(rig->right().own_times(), CameraTimes{});
  EXPECT_EQ(std::get<PinholeRadtan>(rig->left().model()).p2, 0.004);
}

TEST(ForeignCalibration, AFileMayHaveOneCameraOrMoreThanTwo) {
  const std::string first = "%YAML:1.0\n\ncam0:\n" + openvins_camera(kLeft);
  const auto one = parse_openvins_cameras({"chain.yaml", first});
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_EQ(one->camera_count(), 1);
  Pose<B, C1> further = kRight;
  further.p.z() += 0.25;
  const auto three =
      parse_openvins_cameras({"chain.yaml", first + "cam1:\n" + openvins_camera(kRight) + "cam2:\n" + openvins_camera(further)});
  ASSERT_TRUE(three) << three.error().message;
  EXPECT_EQ(three->camera_count(), 3);
  EXPECT_NEAR(three->T_BC(2).p.z() - three->T_BC1().p.z(), 0.25, 1e-6);
  const auto mono = parse_vins_fusion({"config.yaml", vins_fusion()}, {{"left.yaml", kPinhole}});
  ASSERT_TRUE(mono) << mono.error().message;
  EXPECT_FALSE(mono->has_right());
}

TEST(ForeignCalibration, BasaltIsJsonWithPosesAndNoise) {
  const auto rig = parse_basalt({"calibration.json", basalt()});
  expect_rig(rig);
  EXPECT_EQ(std::get<KannalaBrandt>(rig->right().model()).k3, -0.03);
  EXPECT_EQ(rig->imu_noise.accel_noise_density_mps2_rthz, 0.016);
  EXPECT_EQ(rig->imu_noise.gyro_random_walk_radps2_rthz, 0.0001);
  EXPECT_NEAR(rig->time_offset_s, 0.002, 1e-15);
  EXPECT_EQ(parse_basalt({"c.json", basalt("fov")}).error().message,
            "c.json:1: camera_type: 'fov' is not supported, only pinhole, pinhole-radtan8, kb4, ds and eucm");
}

TEST(ForeignCalibration, BasaltsWideLensesAreRead) {
  const std::string kb4 = R"("k1": 0.01, "k2": 0.02, "k3": -0.03, "k4": 0.004)";
  const auto with = [&](const std::string& model, const std::string& numbers) {
    std::string text = basalt(model);
    for (std::size_t at = 0; (at = text.find(kb4)) != std::string::npos;) text.replace(at, kb4.size(), numbers);
    return parse_basalt({"c.json", text});
  };
  const auto ds = with("ds", R"("xi": -0.172, "alpha": 0.593)"), eucm = with("eucm", R"("alpha": 0.63, "beta": 1.04)");
  expect_rig(ds);
  EXPECT_EQ(std::get<DoubleSphere>(ds->left().model()).xi, -0.172);
  EXPECT_EQ(std::get<DoubleSphere>(ds->right().model()).alpha, 0.593);
  expect_rig(eucm);
  EXPECT_EQ(std::get<ExtendedUnified>(eucm->right().model()).beta, 1.04);
  EXPECT_EQ(eucm->left().focal_px(), 0.5 * (380.5 + 380.25));
  EXPECT_NE(with("ds", R"("xi": -1.2, "alpha": 0.6)").error().message.find("xi is -1.2, not between -1 and 1"),
            std::string::npos);
  EXPECT_NE(with("eucm", R"("alpha": 1.2, "beta": 1)").error().message.find("alpha is 1.2, not between 0 and 1"),
            std::string::npos);
}

TEST(ForeignCalibration, TakesALensOfMoreThan180Degrees) {
  std::string text = basalt("kb4");
  const auto replace_all = [&](const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from)) != std::string::npos;) text.replace(at, from.size(), to);
  };
  replace_all("380.5", "150");
  replace_all("380.25", "150");
  replace_all(R"("k1": 0.01, "k2": 0.02, "k3": -0.03)", R"("k1": 0, "k2": 0, "k3": 0)");
  const Result<StereoRig> rig = parse_basalt({"c.json", text});
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_TRUE(rig->left().sees_backwards());
}

TEST(ForeignCalibration, VinsFusionHasAFileACamera) {
  const std::string text = vins_fusion(), name = "config.yaml", left = "left.yaml", right = "right.yaml";
  const auto rig = parse_vins_fusion({name, text}, {{left, kPinhole}, {right, kFisheye}});
  expect_rig(rig);
  EXPECT_EQ(std::get<PinholeRadtan>(rig->left().model()).k1, -0.28);
  EXPECT_EQ(std::get<KannalaBrandt>(rig->right().model()).k4, 0.04);
  EXPECT_EQ(rig->right().focal_px(), 380.5);
  EXPECT_NEAR(rig->imu_noise.accel_noise_density_mps2_rthz, 0.1 / std::sqrt(200), 1e-12);
  const std::string mei =
      "%YAML:1.0\n---\nmodel_type: MEI\nimage_width: 752\nimage_height: 480\nmirror_parameters:\n   xi: 0.9\ndistortion_parameters:\n"
      "   k1: -0.02\n   k2: 0.06\n   p1: 0.001\n   p2: 0.002\nprojection_parameters:\n   gamma1: 830\n   gamma2: 829\n   u0: 370\n   v0: "
      "240\n";
  const auto with_mei = parse_vins_fusion({name, text}, {{left, mei}, {right, kPinhole}});
  expect_rig(with_mei);
  EXPECT_EQ(std::get<UnifiedRadtan>(with_mei->left().model()).xi, 0.9);
  EXPECT_EQ(std::get<UnifiedRadtan>(with_mei->left().model()).p2, 0.002);
  const std::string other = "model_type: SCARAMUZZA\nimage_width: 752\nimage_height: 480\nprojection_parameters:\n   xi: 1\n";
  EXPECT_EQ(parse_vins_fusion({name, text}, {{left, other}, {right, other}}).error().message,
            "left.yaml:1: model_type: 'SCARAMUZZA' is not supported, only PINHOLE, KANNALA_BRANDT and MEI");
}

/// A pair turned against each other, as ROS writes it: both rectified to the frame whose x axis is the baseline.
TEST(ForeignCalibration, CameraInfoSaysHowTheCamerasSeeEachOther) {
  const Pose<C1, C0> T_C1C0 = kRight.inverse() * kLeft;
  const Vec3 baseline_C0 = kLeft.R().transpose() * (kRight.p - kLeft.p);
  const Vec3 x = baseline_C0.normalized(), z = (Vec3::UnitZ() - x.z() * x).normalized(), y = z.cross(x);
  Mat3 R0;
  R0 << x.transpose(), y.transpose(), z.transpose();
  const Mat3 R1 = R0 * T_C1C0.R().transpose();
  const auto file = [](const Mat3& R, double shift) {
    std::string rows;
    for (int i = 0; i < 9; ++i) rows += fmt::format("{}{:.17g}", i > 0 ? ", " : "", R(i / 3, i % 3));
    return fmt::format(
        "image_width: 752\nimage_height: 480\ncamera_name: stereo\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [460, 0, 370, 0, 461, "
        "240, 0, 0, 1]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0.1, 0.2, 0.01, 0.02, "
        "0]\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [{}]\nprojection_matrix:\n  rows: 3\n  cols: 4\n  data: [430, 0, 300, "
        "{:.17g}, 0, 430, 240, 0, 0, 0, 1, 0]\n",
        rows, 430 * shift);
  };
  const std::string left = file(R0, 0), right = file(R1, -baseline_C0.norm()), a = "left.yaml", b = "right.yaml";
  const auto rig = parse_camera_info({a, left}, {b, right}, kLeft);
  expect_rig(rig);
  EXPECT_EQ(std::get<PinholeRadtan>(rig->left().model()).p1, 0.01);
}

TEST(ForeignCalibration, FilesAreToldApartByContent) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "fbvins_foreign_calibration";
  std::filesystem::create_directories(folder);
  const auto write = [&](const char* name, const std::string& text) {
    std::ofstream(folder / name) << text;
    return (folder / name).string();
  };
  write("left.yaml", kPinhole), write("right.yaml", kFisheye);
  write("chain.yaml", "%YAML:1.0\n\ncam0:\n" + openvins_camera(kLeft) + "cam1:\n" + openvins_camera(kRight));
  write("noise.yaml",
        "imu0:\n  accelerometer_noise_density: 0.01\n  accelerometer_random_walk: 0.0002\n  gyroscope_noise_density: 0.005\n"
        "  gyroscope_random_walk: 4.0e-06\n  update_rate: 200.0\n");
  expect_rig(load_calibration(write("vins.yaml", vins_fusion())));
  expect_rig(load_calibration(write("basalt.json", basalt())));
  const auto rig = load_calibration(
      write("estimator.yaml",
            "%YAML:1.0\nverbosity: \"INFO\"\nrelative_config_imu: \"noise.yaml\"\nrelative_config_imucam: \"chain.yaml\"\n"));
  expect_rig(rig);
  EXPECT_EQ(rig->imu_noise.gyro_noise_density_radps_rthz, 0.005);
  EXPECT_NE(load_calibration(write("other.yaml", "a: 1\n")).error().message.find("cam0: is missing"), std::string::npos);
  std::filesystem::remove_all(folder);
}

}  // namespace foreign_calibration_test
}  // namespace fbvins
