// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/imu_axes_fields.hpp"

#include <gtest/gtest.h>

#include "fbvins/io/calibration.hpp"

namespace fbvins {
namespace imu_axes_fields_test {

const std::string kNoise =
    "accelerometer_noise_density: 0.002\naccelerometer_random_walk: 0.003\ngyroscope_noise_density: 0.0002\n"
    "gyroscope_random_walk: 0.00002\nupdate_rate: 200.0\n";

/// C_gyro_i: a quarter turn about z, so that an order of factors that is wrong shows.
const std::string kKalibr = kNoise +
                            "model: scale-misalignment\naccelerometers:\n  M:\n  - [1.02, 0.0, 0.0]\n  - [0.01, 0.98, 0.0]\n"
                            "  - [0.0, -0.02, 1.0]\ngyroscopes:\n  A:\n  - [0.001, 0.0, 0.0]\n  - [0.0, 0.002, 0.0]\n"
                            "  - [0.0, 0.0, 0.0]\n  C_gyro_i:\n  - [0.0, 1.0, 0.0]\n  - [-1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0]\n"
                            "  M:\n  - [1.01, 0.0, 0.0]\n  - [0.03, 0.99, 0.0]\n  - [0.0, 0.0, 1.0]\n";

std::string complaint(const std::string& text) { return parse_imu({"imu.yaml", text}).error().message; }

void expect_reading(const ImuIntrinsics& axes, const ImuSample& raw, const Vec3& rate, const Vec3& force) {
  const ImuSample c = corrected(raw, axes);
  EXPECT_LT((c.gyro_radps - rate).norm(), 1e-12) << c.gyro_radps.transpose();
  EXPECT_LT((c.accel_mps2 - force).norm(), 1e-12) << c.accel_mps2.transpose();
}

/// By hand: w = (1, 2, 3) is (2, -1, 3) in the gyroscope's frame, M of it (2.02, -0.93, 3); f = (10, 20, 30) is (20, -10, 30)
/// there, A of it (0.02, -0.02, 0); M of f (10.2, 19.7, 29.6).
TEST(ImuAxesFields, KalibrsGyroscopeHasAFrameOfItsOwn) {
  const auto imu = parse_imu({"imu.yaml", kKalibr});
  ASSERT_TRUE(imu) << imu.error().message;
  expect_reading(imu->axes, {{}, {2.04, -0.95, 3}, {10.2, 19.7, 29.6}}, {1, 2, 3}, {10, 20, 30});
}

/// The same numbers, but OpenVINS feels forces in the IMU's frame: Tg f = (0.01, 0.04, 0).
TEST(ImuAxesFields, OpenVinsFeelsForcesInTheImusFrame) {
  const auto imu =
      parse_imu({"imu.yaml", kNoise + "model: \"kalibr\"\nTw:\n  - [1.01, 0.0, 0.0]\n  - [0.03, 0.99, 0.0]\n  - [0.0, 0.0, 1.0]\n"
                                      "R_IMUtoGYRO:\n  - [0.0, 1.0, 0.0]\n  - [-1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0]\n"
                                      "Ta:\n  - [1.02, 0.0, 0.0]\n  - [0.01, 0.98, 0.0]\n  - [0.0, -0.02, 1.0]\n"
                                      "R_IMUtoACC:\n  - [0.0, 1.0, 0.0]\n  - [-1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0]\n"
                                      "Tg:\n  - [0.001, 0.0, 0.0]\n  - [0.0, 0.002, 0.0]\n  - [0.0, 0.0, 0.0]\n"});
  ASSERT_TRUE(imu) << imu.error().message;
  // Ta (20, -10, 30) = (20.4, -9.6, 30.2)
  expect_reading(imu->axes, {{}, {2.03, -0.89, 3}, {20.4, -9.6, 30.2}}, {1, 2, 3}, {10, 20, 30});
}

/// S raw - b, row by row: (1.1 x 1 + 0.1 x 2 - 0.3, 2 - 0.2, 3 - 0.1).
TEST(ImuAxesFields, RealSenseSaysWhatIsMadeOfAReading) {
  const ImuNoise before{.gyro_noise_density_radps_rthz = 0.5};
  const auto imu = parse_imu(
      {"rs.json",
       R"({"device_type": "D435i", "imus": [{"accelerometer": {"bias": [0.3, 0.2, 0.1], "scale_and_alignment": [1.1, 0.1, 0, 0, 1, 0, 0, 0, 1]},
          "gyroscope": {"bias": [0.01, 0, -0.02], "scale_and_alignment": [1, 0, 0, 0, 1, 0, 0, 0, 1]}}]})"},
      before);
  ASSERT_TRUE(imu) << imu.error().message;
  EXPECT_EQ(imu->gyro_noise_density_radps_rthz, 0.5) << "the file has no noise";
  expect_reading(imu->axes, {{}, {1, 2, 3}, {1, 2, 3}}, {0.99, 2, 3.02}, {1.0, 1.8, 2.9});
}

/// (1 + S) raw - b; the accelerometer's six numbers are a lower triangle, column by column, the gyroscope's nine a matrix
/// likewise.
TEST(ImuAxesFields, BasaltsNumbersGoColumnByColumn) {
  YamlReader yaml("calibration.json",
                  R"({"calib_accel_bias": [0.1, 0.2, 0.3, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06],
                      "calib_gyro_bias": [0.01, 0.02, 0.03, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09]})");
  const ImuIntrinsics axes = read_basalt_axes(yaml, yaml.root());
  ASSERT_TRUE(yaml.ok()) << yaml.error().message;
  expect_reading(axes, {{}, {1, 2, 3}, {1, 2, 3}},
                 {1 + .01 + .08 + .21 - .01, 2 + .02 + .10 + .24 - .02, 3 + .03 + .12 + .27 - .03},
                 {1 + .01 - .1, 2 + .02 + .08 - .2, 3 + .03 + .10 + .18 - .3});
}

TEST(ImuAxesFields, WhatIsWrittenReadsBack) {
  ImuIntrinsics axes = parse_imu({"imu.yaml", kKalibr})->axes;
  axes.bias = {{0.01, 0.02, -0.03}, {0.1, -0.2, 1.0 / 3}};
  const auto exact = parse_imu({"a", kNoise + imu_axes_text(axes, "", true)}),
             kalibr = parse_imu({"b", kNoise + imu_axes_text(axes, "", false)});
  ASSERT_TRUE(exact && kalibr);
  EXPECT_TRUE(exact->axes == axes) << "to the last bit";
  EXPECT_LT((kalibr->axes.gyro - axes.gyro).norm(), 1e-14);
  EXPECT_LT((kalibr->axes.gyro_by_force - axes.gyro_by_force).norm(), 1e-14);
  EXPECT_NE(imu_axes_text(axes, "", false).find("  M:\n  - [1.01, 0.0, 0.0]\n"), std::string::npos)
      << imu_axes_text(axes, "", false);
  EXPECT_EQ(imu_axes_text({}, "", true), "");
}

TEST(ImuAxesFields, OneCalibrationAfterAnother) {
  const ImuIntrinsics given = parse_imu({"imu.yaml", kKalibr})->axes;
  ImuIntrinsics found{.bias = {{0.01, 0.02, -0.03}, {0.1, -0.2, 0.3}}};
  found.gyro(0, 1) = 0.02, found.accel(1, 0) = -0.03, found.gyro_by_force(2, 2) = 0.001;
  const ImuSample raw{{}, {1, -2, 0.5}, {3, 9, -2}};
  const ImuSample twice = corrected(corrected(raw, given), found), once = corrected(raw, followed_by(given, found));
  EXPECT_LT((twice.gyro_radps - once.gyro_radps).norm() + (twice.accel_mps2 - once.accel_mps2).norm(), 1e-12);
}

TEST(ImuAxesFields, WhatNoImuHasIsRefused) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = kKalibr;
    return text.replace(text.find(from), from.size(), to);
  };
  EXPECT_EQ(
      complaint(with("model: scale-misalignment", "model: scale-misalignment-size-effect")),
      "imu.yaml:6: model: scale-misalignment-size-effect gives each axis of the accelerometer a place of its own, which is not "
      "supported: calibrate with scale-misalignment");
  EXPECT_NE(complaint(with("  M:\n  - [1.01, 0.0, 0.0]", "  M:\n  - [0.45, 0.0, 0.0]")).find("the gyroscope's scale is 0.4"),
            std::string::npos);
  EXPECT_NE(complaint(with("[1.02, 0.0, 0.0]", "[0.0, 0.0, 0.0]")).find("the accelerometer's scale is 0.0"), std::string::npos);
  EXPECT_NE(complaint(with("[1.02, 0.0, 0.0]", "[-1.02, 0.0, 0.0]")).find("left-handed"), std::string::npos);
  EXPECT_FALSE(complaint(with("[1.02, 0.0, 0.0]", "[.nan, 0.0, 0.0]")).empty());
  EXPECT_NE(complaint(with("[-1.0, 0.0, 0.0]", "[-1.2, 0.0, 0.0]")).find("C_gyro_i: is not a rotation"), std::string::npos);
  EXPECT_NE(complaint(with("[0.001, 0.0, 0.0]", "[0.1, 0.0, 0.0]")).find("sensitivity to forces"), std::string::npos);
  EXPECT_NE(complaint(kNoise + "gyroscope_bias: [0, 3, 0]\n").find("bias is more than"), std::string::npos);
  EXPECT_NE(complaint(kNoise + "gyroscopes:\n  A: [0, 0, 0, 0, 0, 0, 0, 0, 0]\n").find("gyroscopes: has no matrix M"),
            std::string::npos);
  EXPECT_NE(complaint(kNoise + "Tw: [1, 0, 0]\n").find("Tw: has 3 numbers"), std::string::npos);
}

}  // namespace imu_axes_fields_test
}  // namespace fbvins
