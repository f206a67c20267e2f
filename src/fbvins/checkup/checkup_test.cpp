// SPDX-License-Identifier: Apache-2.0
// Checks of the first seconds: units, stamps, left and right.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "fbvins/checkup/first_seconds.hpp"
#include "fbvins/checkup/reading_noise_seen.hpp"
#include "fbvins/checkup/reading_units.hpp"
#include "fbvins/checkup/stamps.hpp"
#include "fbvins/checkup/stereo_order.hpp"
#include "fbvins/core/rng.hpp"
#include "tests/support/imu_test_motion.hpp"
#include "tests/support/noise_texture.hpp"

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
  rig.cameras.assign(2, {Camera(PinholeRadtan{.fx = 300, .fy = 300, .cx = 240, .cy = 160}, 480, 320), {}});
  rig.cameras[1].T_BC = Pose<B, C0>(Quat::Identity(), Vec3(0.12, 0, 0));
  return rig;
}

/// A wall 2 m ahead of the rig.
StereoFrame wall(Time t) {
  const NoiseTexture texture{7, 24};
  const auto image = [&](double shift_px, std::uint64_t seed) {
    return std::make_shared<const Image>(render_texture(
        480, 320, texture, [&](const Vec2& px) { return Vec2(px.x() + shift_px, px.y()); }, 120, 35, 1.0, seed));
  };
  return {t, {image(0, 1), image(300 * 0.12 / 2, 2)}};
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

TEST(Checkup, DegreesThatLookLikeGravityAreNotExchanged) {
  auto samples = readings();
  for (ImuSample& sample : samples) {
    sample.gyro_radps = Vec3(9.8, 0, 0);
    sample.accel_mps2 = Vec3(0, 0, 1 + 0.01 * std::sin(3 * sample.t.seconds()));
  }
  const auto findings = check_reading_units(samples);
  EXPECT_TRUE(says(findings, FindingKind::gyro_units));
  for (const Finding& finding : findings) EXPECT_EQ(finding.advice.find("exchanged"), std::string::npos) << finding.advice;
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

TEST(Checkup, TellsALateImuFromAnotherClock) {
  const auto found = [](double first_image_s, double last_image_s, double first_reading_s, double last_reading_s) {
    const auto at = [](double s) { return Time{Duration::from_seconds(1000 + s).ns}; };
    const auto finding = check_ends({at(first_image_s), at(last_image_s), at(first_reading_s), at(last_reading_s)}, rig());
    return finding ? std::string(to_string(finding->kind)) + ": " + finding->measured : std::string();
  };
  EXPECT_EQ(found(0, 10, -0.3, 10.2), "");
  EXPECT_EQ(found(0, 10, -1, 9.3), "imu_gaps: the readings end 0.700 s before the last image");
  EXPECT_EQ(found(0, 17, 3.5, 17.2), "imu_gaps: the readings begin 3.500 s after the first image");
  EXPECT_EQ(found(0, 5, 3.5, 5), "imu_gaps: the readings begin 3.500 s after the first image");
  EXPECT_EQ(
      found(0, 17, 2.5, 20.2),
      "clocks_apart: the readings begin 2.500 s after the first image and end 3.200 s after the last image, as if one clock "
      "were set otherwise");
  EXPECT_EQ(found(0, 17, -3.5, 14.2).substr(0, 12), "clocks_apart");
  EXPECT_EQ(found(0, 10, 18000, 18010).substr(0, 12), "clocks_apart");
  EXPECT_EQ(found(0, 10, -900, -890).substr(0, 12), "clocks_apart");
}

TEST(Checkup, NamesWrongStamps) {
  auto twice = readings(), elsewhere = readings();
  for (std::size_t i = 1; i < twice.size(); i += 2)
    twice[i].gyro_radps = twice[i - 1].gyro_radps, twice[i].accel_mps2 = twice[i - 1].accel_mps2;
  EXPECT_TRUE(says(check_stamps(twice, stamps(), rig()), FindingKind::imu_stamps));
  for (ImuSample& sample : elsewhere) sample.t = sample.t + Duration{100'000'000'000};
  EXPECT_TRUE(says(check_stamps(elsewhere, stamps(), rig()), FindingKind::clocks_apart));
  auto shifted = readings();
  for (ImuSample& sample : shifted) sample.t = sample.t + Duration{1'500'000'000};
  EXPECT_TRUE(says(check_stamps(shifted, stamps(), rig()), FindingKind::clocks_apart));
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
  const auto rest = [&](const auto& leave_out) {
    std::vector<ImuSample> kept;
    const std::vector<ImuSample> all = readings();
    for (std::size_t i = 0; i < all.size(); ++i)
      if (!leave_out(i)) kept.push_back(all[i]);
    return check_stamps(kept, stamps(), rig());
  };
  const auto tenths = rest([](std::size_t i) { return i % 10 == 5; });
  ASSERT_TRUE(only(tenths, FindingKind::imu_gaps)) << "one of ten";
  EXPECT_NE(tenths[0].measured.find("(10.0 %)"), std::string::npos) << tenths[0].measured;
  EXPECT_TRUE(only(rest([](std::size_t i) { return i % 40 < 2; }), FindingKind::imu_gaps)) << "two of forty";
  EXPECT_TRUE(rest([](std::size_t i) { return i % 100 == 5; }).empty()) << "one of a hundred";
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

TEST(Checkup, NamesReadingsThatWereNotMeasured) {
  auto held = readings();
  for (std::size_t i = 301; i < 321; ++i) held[i].gyro_radps = held[300].gyro_radps, held[i].accel_mps2 = held[300].accel_mps2;
  const auto found = check_stamps(held, stamps(), rig());
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].kind, FindingKind::imu_gaps);
  EXPECT_NEAR(found[0].size, 0.1, 1e-9);
  EXPECT_NE(found[0].measured.find("1 time, the longest for 0.100 s"), std::string::npos) << found[0].measured;
  auto zeros = readings();
  for (const std::size_t from : {200u, 500u})
    for (std::size_t i = from; i < from + 15; ++i) zeros[i].gyro_radps.setZero(), zeros[i].accel_mps2.setZero();
  ASSERT_TRUE(says(check_stamps(zeros, stamps(), rig()), FindingKind::imu_gaps));
  EXPECT_NE(check_stamps(zeros, stamps(), rig())[0].measured.find("2 times"), std::string::npos);
}

TEST(Checkup, NamesReadingsStampedInBursts) {
  const std::vector<ImuSample> all = readings();
  std::vector<ImuSample> bursts = all;
  for (std::size_t i = 0; i < bursts.size(); ++i)
    bursts[i].t = all[i / 10 * 10].t + Duration{static_cast<std::int64_t>(i % 10) * 20'000};
  const auto found = check_stamps(bursts, stamps(), rig());
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].kind, FindingKind::imu_stamps);
  EXPECT_NE(found[0].advice.find("a block of them"), std::string::npos);
  EXPECT_EQ(found[0].corrected, "");
}

TEST(Checkup, JitterIsNoGap) {
  Rng rng(3);
  auto jittered = readings();
  for (ImuSample& sample : jittered) sample.t = sample.t + Duration::from_seconds(0.002 * rng.normal());
  std::sort(jittered.begin(), jittered.end(), [](const ImuSample& a, const ImuSample& b) { return a.t < b.t; });
  EXPECT_FALSE(says(check_stamps(jittered, stamps(), rig()), FindingKind::imu_gaps));
  std::vector<ImuSample> in_ms = readings();  // 225 Hz, stamped in whole milliseconds
  for (std::size_t i = 0; i < in_ms.size(); ++i)
    in_ms[i].t = Time{static_cast<std::int64_t>(static_cast<double>(i) * 1e3 / 225) * 1'000'000};
  EXPECT_FALSE(says(check_stamps(in_ms, {}, rig()), FindingKind::imu_gaps));
}

TEST(Checkup, LostImagesAreNoIrregularStamps) {
  auto images = stamps();
  images.erase(images.begin() + 20);
  images.erase(images.begin() + 50, images.begin() + 52);
  EXPECT_TRUE(check_stamps(readings(), images, rig()).empty());
}

/// Stamps whose intervals are these in turns, each for `run` images, off by up to `off_ns`.
std::vector<Time> stamps_in_turns(const std::vector<double>& intervals_ms, int run, std::int64_t off_ns) {
  std::vector<Time> images{Time{1'100'000'000}};
  for (std::size_t i = 0; images.back().seconds() < 6.9; ++i) {
    const double ms = intervals_ms[i / static_cast<std::size_t>(run) % intervals_ms.size()];
    const std::int64_t off =
        off_ns == 0 ? 0 : static_cast<std::int64_t>(i * 2654435761U % static_cast<std::size_t>(2 * off_ns)) - off_ns;
    images.push_back(images.back() + Duration{static_cast<std::int64_t>(1e6 * ms) + off});
  }
  return images;
}

TEST(Checkup, IntervalsByExposureAreNoStampsOfArrival) {
  const auto exact = stamps_in_turns({33.17, 40.05, 50.01, 59.96}, 9, 500);
  EXPECT_TRUE(check_stamps(readings(), exact, rig()).empty());
  EXPECT_TRUE(check_stamps(readings(), stamps_in_turns({33.3, 66.6}, 12, 0), rig()).empty()) << "half as many in less light";
  auto lost = exact;
  for (std::size_t i = 5; i + 1 < lost.size(); i += 9) lost.erase(lost.begin() + static_cast<std::ptrdiff_t>(i));
  EXPECT_TRUE(says(check_stamps(readings(), lost, rig()), FindingKind::image_gaps)) << "lost ones are still missed";
}

TEST(Checkup, StampsOfArrivalAreNoIntervals) {
  EXPECT_TRUE(says(check_stamps(readings(), stamps_in_turns({33, 40, 50}, 1, 6'000'000), rig()), FindingKind::image_stamps));
  EXPECT_TRUE(says(check_stamps(readings(), stamps_in_turns({30, 30, 40}, 1, 0), rig()), FindingKind::image_stamps))
      << "a clock that ticks every 10 ms";
  EXPECT_TRUE(says(check_stamps(readings(), stamps_in_turns({44, 45, 47, 48, 50, 51, 53, 56, 41}, 1, 0), rig()),
                   FindingKind::image_stamps))
      << "whole milliseconds";
}

TEST(Checkup, ImagesThinnedToAnotherRateAreNoIrregularStamps) {
  EXPECT_TRUE(check_stamps(readings(), stamps_in_turns({150, 150, 150, 100, 150, 150}, 1, 50'000), rig()).empty())
      << "20 to 7 Hz";
  EXPECT_TRUE(check_stamps(readings(), stamps_in_turns({100, 133.333, 133.333}, 1, 50'000), rig()).empty()) << "30 to 8 Hz";
  EXPECT_FALSE(says(check_stamps(readings(), stamps_in_turns({50, 100, 150, 100}, 1, 0), rig()), FindingKind::image_stamps));
  EXPECT_TRUE(
      says(check_stamps(readings(), stamps_in_turns({150, 150, 125, 150}, 1, 9'000'000), rig()), FindingKind::image_stamps));
}

/// White noise of these densities at 200 Hz, at rest or in motion.
std::vector<ImuSample> noisy(double gyro, double accel, bool moving) {
  Rng rng(7);
  std::vector<ImuSample> out;
  for (std::int64_t i = 0; i < 2000; ++i) {
    ImuSample s{Time{1'000'000'000 + i * 5'000'000}, {}, {}};
    const double root = std::sqrt(200.0), phase = 0.02 * static_cast<double>(i);
    for (int k = 0; k < 3; ++k)
      s.gyro_radps(k) = gyro * root * rng.normal() + (moving ? 0.5 * std::sin(phase + k) : 0.01),
      s.accel_mps2(k) = accel * root * rng.normal() + (moving ? std::cos(phase + 2 * k) : 0) + (k == 2 ? 9.8 : 0);
    out.push_back(s);
  }
  return out;
}

TEST(Checkup, MeasuresTheNoiseThatIsDeclared) {
  for (const bool moving : {false, true}) {
    const auto readings = noisy(2e-4, 2e-3, moving);
    const auto seen = reading_noise_seen(readings);
    ASSERT_TRUE(seen);
    EXPECT_NEAR(seen->quietest.gyro_radps_rthz, 2e-4, 5e-5);
    EXPECT_NEAR(seen->quietest.accel_mps2_rthz, 2e-3, 5e-4);
    EXPECT_EQ(seen->at_rest.has_value(), !moving);
    ImuNoise declared, write;
    declared.gyro_noise_density_radps_rthz = 2e-4, declared.accel_noise_density_mps2_rthz = 2e-3;
    EXPECT_FALSE(check_declared_noise(readings, declared, write));
    declared.accel_noise_density_mps2_rthz = 0.06;
    const auto large = check_declared_noise(readings, declared, write);
    ASSERT_TRUE(large);
    EXPECT_EQ(large->kind, FindingKind::imu_noise);
    EXPECT_NEAR(large->size, 35, 8);
    EXPECT_NEAR(write.accel_noise_density_mps2_rthz, 4e-3, 1e-3);
    declared.accel_noise_density_mps2_rthz = 1e-4;
    EXPECT_EQ(check_declared_noise(readings, declared, write).has_value(), !moving) << "vibration may be all of it";
  }
}

TEST(Checkup, SeesLeftAndRightExchanged) {
  StereoFrame frame = wall(Time{1});
  EXPECT_FALSE(stereo_order(rig(), std::span(&frame, 1)).swapped());
  frame.swap_left_right();
  const StereoOrder order = stereo_order(rig(), std::span(&frame, 1));
  EXPECT_TRUE(order.swapped()) << order.as_named << " " << order.as_swapped << " of " << order.features;
  EXPECT_TRUE(check_stereo_order(order));
}

/// Spots of an infrared projector, which move with the camera.
TEST(Checkup, SeesAProjectorThatIsOn) {
  FirstSeconds plain(rig()), lit(rig());
  Rng rng(3);
  std::vector<Vec2> spots;
  for (int y = 10; y < 310; y += 20)
    for (int x = 10; x < 470; x += 20) {
      const double dx = rng.uniform(0, 8), dy = rng.uniform(0, 8);
      spots.emplace_back(x + dx, y + dy);
    }
  for (const Time t : {Time{1'000'000'000}, Time{3'000'000'000}, Time{5'000'000'000}}) {
    StereoFrame frame = wall(t);
    plain.push(frame);
    auto left = std::make_shared<Image>(*frame.left());
    for (const Vec2& spot : spots)
      for (int y = 0; y < left->height(); ++y)
        for (int x = 0; x < left->width(); ++x)
          if (const double far = (Vec2(x, y) - spot).squaredNorm(); far < 16)
            left->at(x, y) = static_cast<std::uint8_t>(std::min(255.0, left->at(x, y) + 110 * std::exp(-0.5 * far)));
    frame.set_image(0, left);
    lit.push(frame);
  }
  EXPECT_FALSE(says(plain.findings(), FindingKind::projector_dots));
  EXPECT_TRUE(says(lit.findings(), FindingKind::projector_dots));
}

TEST(Checkup, AFindingIsOneLineAndItsCorrections) {
  Finding finding;
  finding.kind = FindingKind::time_offset;
  finding.measured = "a", finding.expected = "b", finding.advice = "c", finding.corrected = "d: 1\ne: 2";
  EXPECT_EQ(to_text(finding), "time_offset: a; b; c\n    d: 1\n    e: 2");
}

}  // namespace checkup_test
}  // namespace fbvins
