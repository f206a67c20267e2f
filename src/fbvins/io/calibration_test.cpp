// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/calibration.hpp"
#include "fbvins/io/kalibr.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>

#include "fbvins/io/yaml_reader.hpp"
#include "tests/support/kalibr_test_files.hpp"

namespace fbvins {
namespace calibration_test {

std::string rows_of(const Mat3& R, const Vec3& p, const char* open, const char* close, const char* between) {
  std::string out;
  for (int i = 0; i < 3; ++i)
    out += fmt::format("{}{:.17g}, {:.17g}, {:.17g}, {:.17g}{}{}", open, R(i, 0), R(i, 1), R(i, 2), p(i), close, between);
  return out + open + "0.0, 0.0, 0.0, 1.0" + close;
}

std::string euroc_camera(const Pose<B, B>& T_BS) {
  return "%YAML:1.0\n---\nsensor_type: camera\nT_BS: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: d\n  data: [" +
         rows_of(T_BS.R(), T_BS.p, "", "", ",\n    ") +
         "]\nrate_hz: 30\nresolution: [752, 480]\ncamera_model: pinhole\nintrinsics: [458.6, 457.2, 367.2, 248.3]\n"
         "distortion_model: equidistant\ndistortion_coefficients: [0.1, 0.2, 0.3, 0.4]\n";
}

std::string kalibr_camera(const char* extrinsic, const Pose<B, B>& T) {
  return fmt::format("  {}:\n{}\n", extrinsic, rows_of(T.R(), T.p, "  - [", "]", "\n")) +
         "  cam_overlaps: [1]\n  camera_model: pinhole\n  distortion_coeffs: [0.1, 0.2, 0.3, 0.4]\n  distortion_model: equidistant\n"
         "  intrinsics: [458.6, 457.2, 367.2, 248.3]\n  resolution: [752, 480]\n  rostopic: /cam/image_raw\n";
}

const Pose<B, B> kLeft(so3_exp({0.1, -0.2, 1.5}), {0.01, -0.02, 0.03});
const Pose<B, B> kRight(so3_exp({0.12, -0.19, 1.49}), {0.01, 0.09, 0.03});

template <class P, class Q>
void expect_same(const P& a, const Q& b, double tolerance) {
  EXPECT_LT((a.p - b.p).norm(), tolerance);
  EXPECT_LT((a.R() - b.R()).norm(), tolerance);
}

TEST(Calibration, EurocMountingTakesSensorToBody) {
  auto camera = parse_euroc_camera({"cam0", euroc_camera(kLeft)});
  ASSERT_TRUE(camera) << camera.error().message;
  expect_same(camera->T_BS, kLeft, 1e-14);
  EXPECT_EQ(camera->rate_hz, 30);
  EXPECT_EQ(camera->camera.model_name(), "pinhole-equidistant");
  EXPECT_EQ(std::get<KannalaBrandt>(camera->camera.model()).k4, 0.4);
}

TEST(Calibration, OurBodyIsTheImuEvenWhereThatOfTheFileIsNot) {
  const auto left = parse_euroc_camera({"cam0", euroc_camera(kLeft)}), right = parse_euroc_camera({"cam1", euroc_camera(kRight)});
  ImuSensor imu;
  imu.T_BS = Pose<B, B>(so3_exp({0.3, 0.2, 0.1}), {1, 2, 3});
  const auto rig = join_euroc({*left, *right}, imu, "x");
  ASSERT_TRUE(rig);
  expect_same(imu.T_BS * rig->T_BC0().cast_frames<B, B>(), kLeft, 1e-13);
  expect_same(rig->T_C1C0(), kRight.inverse() * kLeft, 1e-13);
}

TEST(Calibration, KalibrGivesTheSameRigByEitherWay) {
  const std::string cam0 = "cam0:\n" + kalibr_camera("T_cam_imu", kLeft.inverse()) + "  timeshift_cam_imu: -0.004\n";
  const std::string direct = cam0 + "cam1:\n" + kalibr_camera("T_cam_imu", kRight.inverse());
  const std::string chained = cam0 + "cam1:\n" + kalibr_camera("T_cn_cnm1", kRight.inverse() * kLeft);
  for (const std::string& text : {direct, chained}) {
    const auto rig = parse_kalibr_camchain({"chain.yaml", text});
    ASSERT_TRUE(rig) << rig.error().message;
    expect_same(rig->T_BC0(), kLeft, 1e-14);
    expect_same(rig->T_BC1(), kRight, 1e-14);
    EXPECT_EQ(rig->time_offset_s, -0.004);
    EXPECT_EQ(rig->right().width(), 752);
  }
}

TEST(Calibration, KalibrsChainGoesOnFromCameraToCamera) {
  const Pose<B, B> third = kLeft * Pose<B, B>(so3_exp({0, 3, 0}), {0.1, 0.2, 0.3});
  const std::string text = "cam0:\n" + kalibr_camera("T_cam_imu", kLeft.inverse()) + "cam1:\n" +
                           kalibr_camera("T_cn_cnm1", kRight.inverse() * kLeft) + "cam2:\n" +
                           kalibr_camera("T_cn_cnm1", third.inverse() * kRight);
  const auto rig = parse_kalibr_camchain({"chain.yaml", text});
  ASSERT_TRUE(rig) << rig.error().message;
  ASSERT_EQ(rig->camera_count(), 3);
  expect_same(rig->T_BC(2), third, 1e-14);
}

TEST(Calibration, KalibrsWideLensesHaveTheirNumbersBeforeTheFocalLengths) {
  const auto rig_with = [](const char* model, const char* numbers, const char* distortion) {
    std::string camera = kalibr_camera("T_cam_imu", kLeft.inverse());
    const auto replace = [&](const std::string& from, const std::string& to) {
      camera.replace(camera.find(from), from.size(), to);
    };
    replace("camera_model: pinhole", fmt::format("camera_model: {}", model));
    replace("intrinsics: [", fmt::format("intrinsics: [{}, ", numbers));
    replace("distortion_coeffs: [0.1, 0.2, 0.3, 0.4]\n  distortion_model: equidistant", distortion);
    return parse_kalibr_camchain({"chain.yaml", "cam0:\n" + camera + "cam1:\n" + kalibr_camera("T_cam_imu", kRight.inverse())});
  };
  constexpr const char *kNone = "distortion_coeffs: []\n  distortion_model: none",
                       *kRadtan = "distortion_coeffs: [-0.3, 0.1, 0.001, 0.002]\n  distortion_model: radtan";
  const auto ds = rig_with("ds", "-0.2, 0.59", kNone), eucm = rig_with("eucm", "0.6, 1.1", kNone),
             omni = rig_with("omni", "0.8", kRadtan), plain = rig_with("omni", "1", kNone);
  for (const auto* rig : {&ds, &eucm, &omni, &plain}) {
    ASSERT_TRUE(*rig) << rig->error().message;
    EXPECT_EQ((*rig)->left().intrinsics(), (std::array{458.6, 457.2, 367.2, 248.3}));
  }
  EXPECT_EQ(ds->left().model_name(), "ds");
  EXPECT_EQ(ds->left().distortion(), (std::vector{-0.2, 0.59}));
  EXPECT_EQ(std::get<ExtendedUnified>(eucm->left().model()).beta, 1.1);
  EXPECT_EQ(omni->left().distortion(), (std::vector{0.8, -0.3, 0.1, 0.001, 0.002}));
  EXPECT_EQ(plain->left().distortion(), (std::vector{1.0, 0.0, 0.0, 0.0, 0.0}));
  EXPECT_NE(rig_with("ds", "1.5, 0.5", kNone).error().message.find("intrinsics: xi is 1.5, not between -1 and 1"),
            std::string::npos);
  EXPECT_NE(rig_with("eucm", "0.6, -1", kNone).error().message.find("beta is -1, not between 0 and 100"), std::string::npos);
  EXPECT_NE(rig_with("omni", "-0.1", kRadtan).error().message.find("xi is -0.1, not between 0 and 10"), std::string::npos);
  EXPECT_NE(rig_with("ds", "0.1, 0.5", kRadtan).error().message.find("distortion_model: 'radtan' is not supported, only none"),
            std::string::npos);
}

TEST(Calibration, KalibrSaysWhatIsWrong) {
  const std::string good =
      "cam0:\n" + kalibr_camera("T_cam_imu", kLeft.inverse()) + "cam1:\n" + kalibr_camera("T_cam_imu", kRight.inverse());
  const auto message = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    const auto rig = parse_kalibr_camchain({"c.yaml", text});
    return rig ? std::string("accepted") : rig.error().message;
  };
  EXPECT_EQ(message("cam0:", "cam2:"), "c.yaml: cam0: is missing or empty");
  EXPECT_EQ(parse_kalibr_camchain({"c.yaml", good.substr(0, good.find("cam1:")) + "cam1: 6\n"}).error().message,
            "c.yaml:14: cam1: is empty");
  EXPECT_EQ(message("T_cam_imu", "T_imu_cam"), "c.yaml:2: T_cam_imu: is missing");
  EXPECT_EQ(message("distortion_model: equidistant", "distortion_model: fov"),
            "c.yaml:10: distortion_model: 'fov' is not supported, only radtan (plumb_bob, "
            "rational_polynomial), equidistant (fisheye) and none");
  EXPECT_EQ(message("[752, 480]", "[752.5, 480]"), "c.yaml:12: resolution: 752.5 is not a number of pixels");
  EXPECT_EQ(message("458.6", "none"), "c.yaml:11: intrinsics: holds something that is not a number");
  EXPECT_EQ(message("0.0, 0.0, 0.0, 1.0", "0.0, 0.0, 0.5, 1.0"), "c.yaml:3: T_cam_imu: its last row is not 0 0 0 1");
  EXPECT_EQ(message("  rostopic: /cam/image_raw\n", "  timeshift_cam_imu: 99\n"),
            "c.yaml:13: timeshift_cam_imu: 99 s is more than 10 s");
  EXPECT_EQ(parse_kalibr_camchain({"c.yaml", good + "  timeshift_cam_imu: 0.12\n"}).error().message,
            "c.yaml: the time offset of camera 1 differs from camera 0's by 120.0 ms, more than 100 ms");
  EXPECT_EQ(parse_kalibr_camchain({"c.yaml", "cam0: 5\ncam1: 6\n"}).error().message, "c.yaml:1: cam0: is missing or empty");
  EXPECT_EQ(parse_kalibr_camchain({"c.yaml", "- 1\n- 2\n"}).error().message, "c.yaml: holds no fields");
  EXPECT_EQ(load_kalibr("/nowhere/c.yaml").error().message, "/nowhere/c.yaml: no such file");
}

TEST(Calibration, WhatNoLensHasIsRefused) {
  struct Case {
    const char *from, *to, *sentence;
  };
  for (const Case& c : {Case{"367.2, 248.3", "367.2, 100", "(367.2, 100) lies outside the middle third of an image of 752 x 480"},
                        {"458.6, 457.2, 367.2, 248.3", "917.2, 914.4, 734.4, 496.6", "images twice as large?"},
                        {"458.6, 457.2, 367.2, 248.3", "229.3, 228.6, 183.6, 124.1", "images half as large?"},
                        {"equidistant\ndistortion_coefficients: [0.1, 0.2, 0.3, 0.4]",
                         "radial-tangential\ndistortion_coefficients: [26, 0, 0, 0]", "enlarged 2."},
                        {"equidistant\ndistortion_coefficients: [0.1, 0.2, 0.3, 0.4]",
                         "radial-tangential\ndistortion_coefficients: [-26, 0, 0, 0]", "no ray belongs to pixels half way"}}) {
    std::string text = euroc_camera(kLeft);
    const std::string from = c.from;
    text.replace(text.find(from), from.size(), c.to);
    const auto camera = parse_euroc_camera({"cam0.yaml", text});
    ASSERT_FALSE(camera) << c.sentence;
    EXPECT_NE(camera.error().message.find(c.sentence), std::string::npos) << camera.error().message;
    EXPECT_EQ(camera.error().message.rfind("cam0.yaml", 0), 0u) << camera.error().message;
  }
}

TEST(Calibration, LineDelayOfARollingShutter) {
  const std::string cam0 = "cam0:\n" + kalibr_camera("T_cam_imu", kLeft.inverse());
  const std::string cam1 = "cam1:\n" + kalibr_camera("T_cam_imu", kRight.inverse());
  const std::string delay = "  line_delay: 4e-05\n";
  EXPECT_EQ(parse_kalibr_camchain({"c.yaml", cam0 + cam1})->line_delay_s, 0);
  EXPECT_EQ(parse_kalibr_camchain({"c.yaml", cam0 + delay + cam1 + delay})->line_delay_s, 4e-5);
  EXPECT_EQ(parse_kalibr_camchain({"c.yaml", cam0 + delay})->line_delay_s, 4e-5);
  const auto one_alone = parse_kalibr_camchain({"c.yaml", cam0 + delay + cam1});
  ASSERT_TRUE(one_alone) << one_alone.error().message;
  EXPECT_EQ(one_alone->times(0).line_delay_s, 4e-5);
  EXPECT_EQ(one_alone->times(1).line_delay_s, 0) << "a global shutter beside a rolling one";
  EXPECT_FALSE(parse_kalibr_camchain({"c.yaml", cam0 + "  line_delay: 40\n"}));  // microseconds
  EXPECT_DOUBLE_EQ(parse_euroc_camera({"cam0", euroc_camera(kLeft) + "line_delay_us: 40\n"})->line_delay_s, 4e-5);
}

TEST(Calibration, KalibrImuWithAndWithoutItsLevel) {
  const std::string flat =
      "accelerometer_noise_density: 0.01\naccelerometer_random_walk: 0.0002\ngyroscope_noise_density: 0.005\n"
      "gyroscope_random_walk: 4.0e-06\nrostopic: /imu0\nupdate_rate: 200.0\n";
  std::string nested = "imu0:\n";
  for (std::size_t start = 0; start < flat.size(); start = flat.find('\n', start) + 1)
    nested += "  " + flat.substr(start, flat.find('\n', start) + 1 - start);
  for (const std::string& text : {flat, nested}) {
    const auto noise = parse_imu({"imu.yaml", text});
    ASSERT_TRUE(noise) << noise.error().message;
    EXPECT_EQ(noise->accel_noise_density_mps2_rthz, 0.01);
    EXPECT_EQ(noise->gyro_random_walk_radps2_rthz, 4.0e-06);
    EXPECT_EQ(noise->rate_hz, 200);
  }
  EXPECT_EQ(parse_imu({"imu.yaml", "imu0: {}\n"}).error().message, "imu.yaml:1: gyroscope_noise_density: is missing");
}

TEST(Calibration, KalibrsImuMayLieInTheFileOfTheCameras) {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{.fx = 400, .fy = 400, .cx = 320, .cy = 240}, 640, 480), {}});
  rig.cameras[1].T_BC.p = Vec3(0.1, 0, 0);
  const KalibrFiles files(rig);
  ImuNoise otherwise;
  otherwise.rate_hz = 100;
  EXPECT_EQ(load_kalibr(files.camchain(), std::nullopt, otherwise)->imu_noise.rate_hz, 100);
  std::ofstream(files.camchain(), std::ios::app) << "imu0:\n  update_rate: 400\n  accelerometer_noise_density: 0.01\n"
                                                    "  accelerometer_random_walk: 0.001\n  gyroscope_noise_density: 0.001\n"
                                                    "  gyroscope_random_walk: 0.0001\n";
  EXPECT_EQ(load_kalibr(files.camchain(), std::nullopt, otherwise)->imu_noise.rate_hz, 400);
  EXPECT_EQ(load_kalibr(files.camchain(), files.imu())->imu_noise.rate_hz, rig.imu_noise.rate_hz);
}

TEST(Calibration, DeepNestingIsAnErrorNotACrash) {
  EXPECT_FALSE(parse_kalibr_camchain({"deep.yaml", std::string(100000, '[')}));
  EXPECT_FALSE(parse_kalibr_camchain({"deep.yaml", std::string(100000, '{')}));
}

TEST(Calibration, EachCameraHasItsTimes) {
  const auto kalibr = [](const std::string& of_cam1) {
    return *parse_kalibr_camchain({"c.yaml", "cam0:\n" + kalibr_camera("T_cam_imu", kLeft.inverse()) +
                                                 "  timeshift_cam_imu: -0.004\n  line_delay: 2e-05\ncam1:\n" +
                                                 kalibr_camera("T_cam_imu", kRight.inverse()) + of_cam1});
  };
  const StereoRig two = kalibr("  timeshift_cam_imu: 0.001\n  line_delay: 3e-05\n");
  EXPECT_EQ(two.time_offset_s, -0.004);
  EXPECT_EQ(two.line_delay_s, 2e-5);
  EXPECT_DOUBLE_EQ(two.times(1).time_offset_s, 0.001);
  EXPECT_DOUBLE_EQ(two.times(1).line_delay_s, 3e-5);
  EXPECT_EQ(kalibr("  line_delay: 2e-05\n").right().own_times(), CameraTimes{}) << "without a time offset that of cam0";
  const auto euroc = [](const std::string& of_cam0, const std::string& of_cam1) {
    return *join_euroc({*parse_euroc_camera({"cam0", euroc_camera(kLeft) + of_cam0}),
                        *parse_euroc_camera({"cam1", euroc_camera(kRight) + of_cam1})},
                       {}, "rig");
  };
  const StereoRig folder = euroc("timeshift_cam_imu: 0.01\n", "timeshift_cam_imu: 0.012\nline_delay_us: 25\n");
  EXPECT_EQ(folder.times(0), (CameraTimes{0.01, 0}));
  EXPECT_DOUBLE_EQ(folder.times(1).time_offset_s, 0.012);
  EXPECT_DOUBLE_EQ(folder.times(1).line_delay_s, 25e-6);
  EXPECT_EQ(euroc("timeshift_cam_imu: 0.01\n", "").right().own_times(), CameraTimes{});
}

}  // namespace calibration_test
}  // namespace fbvins
