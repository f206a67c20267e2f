// SPDX-License-Identifier: Apache-2.0
// Checks of the first seconds: units, stamps, left and right.
#include <gtest/gtest.h>

#include "fbvins/checkup/first_seconds.hpp"
#include "fbvins/checkup/reading_units.hpp"
#include "fbvins/checkup/stamps.hpp"
#include "fbvins/checkup/stereo_order.hpp"
#include "fbvins/features/noise_texture.hpp"
#include "fbvins/imu/imu_test_motion.hpp"

namespace fbvins {
namespace checkup_test {

std::vector<ImuSample> readings() {
  const test::Motion motion(0.3, 0.3);
  std::vector<ImuSample> samples;
  for (Time t{1'000'000'000}; t.seconds() < 7; t = t + Duration{5'000'000}) samples.push_back(motion.sample(t));
  return samples;
}

std::vector<Time> stamps() {
  std::vector<Time> images;
  for (Time t{1'100'000'000}; t.seconds() < 6.9; t = t + Duration{50'000'000}) images.push_back(t);
  return images;
}

StereoRig rig() {
  StereoRig rig;
  rig.left = rig.right = Camera(PinholeRadtan{.fx = 300, .fy = 300, .cx = 240, .cy = 160}, 480, 320);
  rig.T_BC1 = Pose<B, C1>(Quat::Identity(), Vec3(0.12, 0, 0));
  return rig;
}

/// A wall 2 m ahead of the rig.
StereoFrame wall(Time t) {
  const NoiseTexture texture{7, 24};
  const auto image = [&](double shift_px, std::uint64_t seed) {
    return std::make_shared<const Image>(render_texture(
        480, 320, texture, [&](const Vec2& px) { return Vec2(px.x() + shift_px, px.y()); }, 120, 35, 1.0, seed));
  };
  return {t, image(0, 1), image(300 * 0.12 / 2, 2)};
}

bool says(const std::vector<Finding>& findings, FindingKind kind) {
  for (const Finding& finding : findings)
    if (finding.kind == kind) return true;
  return false;
}

TEST(Checkup, IsSilentWhereAllIsWell) {
  EXPECT_TRUE(check_reading_units(readings()).empty());
  EXPECT_TRUE(check_stamps(readings(), stamps(), rig()).empty());
  FirstSeconds look(rig());
  for (const ImuSample& sample : readings()) look.push(sample);
  for (const Time t : {Time{1'000'000'000}, Time{3'000'000'000}, Time{5'000'000'000}}) look.push(wall(t));
  EXPECT_TRUE(look.findings().empty());
}

TEST(Checkup, NamesUnits) {
  auto in_g = readings(), in_degrees = readings();
  for (ImuSample& sample : in_g) sample.accel_mps2 /= 9.80665;
  for (ImuSample& sample : in_degrees) sample.gyro_radps *= 57.29578;
  const auto findings = check_reading_units(in_g);
  ASSERT_TRUE(says(findings, FindingKind::accel_units));
  EXPECT_NEAR(findings.front().size, 1 / 9.80665, 0.01);
  EXPECT_NE(findings.front().advice.find("9.80665"), std::string::npos);
  EXPECT_TRUE(says(check_reading_units(in_degrees), FindingKind::gyro_units));
}

TEST(Checkup, NamesExchangedSensors) {
  auto samples = readings();
  for (ImuSample& sample : samples) std::swap(sample.gyro_radps, sample.accel_mps2);
  const auto findings = check_reading_units(samples);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_NE(findings[0].advice.find("exchanged"), std::string::npos);
}

TEST(Checkup, UnitsTooCloseToBeDistinguishedAreBothNamed) {
  const auto advice = [](double factor) {
    auto samples = readings();
    for (ImuSample& sample : samples) sample.accel_mps2 *= factor;
    const auto findings = check_reading_units(samples);
    return findings.empty() ? "" : findings.front().advice;
  };
  for (const double factor : {1000 / 9.80665, 100.0}) {  // thousandths of g, cm/s^2
    EXPECT_NE(advice(factor).find("thousandths of g"), std::string::npos) << advice(factor);
    EXPECT_NE(advice(factor).find("0.00980665"), std::string::npos) << advice(factor);
    EXPECT_NE(advice(factor).find("cm/s^2"), std::string::npos) << advice(factor);
    EXPECT_NE(advice(factor).find("0.01"), std::string::npos) << advice(factor);
  }
  EXPECT_EQ(advice(1000), "it looks like mm/s^2: multiply the accelerometer's readings by 0.001");
  EXPECT_EQ(advice(1 / 0.3048), "it looks like feet/s^2: multiply the accelerometer's readings by 0.3048");
}

TEST(Checkup, NamesWrongStamps) {
  auto twice = readings(), elsewhere = readings();
  for (std::size_t i = 1; i < twice.size(); i += 2)
    twice[i].gyro_radps = twice[i - 1].gyro_radps, twice[i].accel_mps2 = twice[i - 1].accel_mps2;
  EXPECT_TRUE(says(check_stamps(twice, stamps(), rig()), FindingKind::imu_stamps));
  for (ImuSample& sample : elsewhere) sample.t = sample.t + Duration{100'000'000'000};
  EXPECT_TRUE(says(check_stamps(elsewhere, stamps(), rig()), FindingKind::clocks_apart));
  auto irregular = stamps();
  for (std::size_t i = 0; i < irregular.size(); i += 3) irregular[i] = irregular[i] + Duration{12'000'000};
  EXPECT_TRUE(says(check_stamps(readings(), irregular, rig()), FindingKind::image_stamps));
  StereoRig faster = rig();
  faster.imu_noise.rate_hz = 400;
  const auto findings = check_stamps(readings(), stamps(), faster);
  ASSERT_TRUE(says(findings, FindingKind::imu_stamps));
  EXPECT_EQ(findings.front().corrected, "rate_hz: 200");
  auto in_microseconds = readings();
  for (ImuSample& sample : in_microseconds) sample.t.ns /= 1000;
  const auto unit = check_stamps(in_microseconds, {}, rig());
  ASSERT_TRUE(says(unit, FindingKind::imu_stamps));
  EXPECT_NE(unit.front().advice.find("microseconds"), std::string::npos);
  EXPECT_EQ(unit.front().corrected, "");
}

TEST(Checkup, NamesGaps) {
  const auto only = [](const std::vector<Finding>& findings, FindingKind kind) {
    return findings.size() == 1 && findings[0].kind == kind;
  };
  auto gap = readings();
  gap.erase(gap.begin() + 400, gap.begin() + 412);
  const auto found = check_stamps(gap, stamps(), rig());
  ASSERT_TRUE(only(found, FindingKind::imu_gaps));
  EXPECT_EQ(found[0].measured.substr(0, 43), "12 readings (1.0 %) are missing in 1 gap, t") << found[0].measured;
  std::vector<ImuSample> slow;
  for (std::size_t i = 0; i < readings().size(); i += 12) slow.push_back(readings()[i]);
  EXPECT_FALSE(says(check_stamps(slow, stamps(), rig()), FindingKind::imu_gaps)) << "a slow IMU has no gaps";
  auto single = readings();
  single.erase(single.begin() + 400);
  EXPECT_TRUE(check_stamps(single, stamps(), rig()).empty()) << "one reading is nothing";
  auto short_one = readings();
  short_one.resize(short_one.size() / 2);
  EXPECT_TRUE(only(check_stamps(short_one, stamps(), rig()), FindingKind::imu_gaps)) << "the IMU ends before the images";
  auto sevenths = stamps();
  for (std::size_t i = sevenths.size() / 7; i > 0; --i) sevenths.erase(sevenths.begin() + static_cast<std::ptrdiff_t>(7 * i - 1));
  EXPECT_TRUE(only(check_stamps(readings(), sevenths, rig()), FindingKind::image_gaps));
  auto pause = stamps();
  pause.erase(pause.begin() + 20, pause.begin() + 32);
  EXPECT_TRUE(only(check_stamps(readings(), pause, rig()), FindingKind::image_gaps));
}

TEST(Checkup, LostImagesAreNoIrregularStamps) {
  auto images = stamps();
  images.erase(images.begin() + 20);
  images.erase(images.begin() + 50, images.begin() + 52);
  EXPECT_TRUE(check_stamps(readings(), images, rig()).empty());
}

TEST(Checkup, SeesLeftAndRightExchanged) {
  StereoFrame frame = wall(Time{1});
  EXPECT_FALSE(stereo_order(rig(), std::span(&frame, 1)).swapped());
  std::swap(frame.left, frame.right);
  const StereoOrder order = stereo_order(rig(), std::span(&frame, 1));
  EXPECT_TRUE(order.swapped()) << order.as_named << " " << order.as_swapped << " of " << order.features;
  EXPECT_TRUE(check_stereo_order(order));
}

TEST(Checkup, AFindingIsOneLineAndItsCorrections) {
  Finding finding;
  finding.kind = FindingKind::time_offset;
  finding.measured = "a", finding.expected = "b", finding.advice = "c", finding.corrected = "d: 1\ne: 2";
  EXPECT_EQ(to_text(finding), "time_offset: a; b; c\n    d: 1\n    e: 2");
}

}  // namespace checkup_test
}  // namespace fbvins
