// SPDX-License-Identifier: Apache-2.0
// The whole system: threads give the same bits as without them, and what each part is given.
#include "fbvins/pipeline/system.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "tests/support/sway_recording.hpp"

namespace fbvins {
namespace system_test {

using namespace sway_recording;

struct Outcome {
  std::vector<std::string> odometry;
  int with_pose = 0;
  std::int64_t keyframes = 0;
  Odometry last;
};

Outcome fly(RunMode mode, const std::string& frontend) {
  Outcome outcome;
  System system = system_of(mode, {}, frontend);
  system.on_keyframe([&](const Keyframe&) { ++outcome.keyframes; });
  system.on_odometry([&](const Odometry& o) {
    outcome.odometry.push_back(bytes_of(o));
    outcome.with_pose += o.health.has_pose();
    outcome.last = o;
  });
  push_all(system, recording());
  EXPECT_TRUE(system.finish().ok());
  return outcome;
}

class Frontends : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(System, Frontends, testing::Values("klt", "orb"));

TEST_P(Frontends, ThreadsGiveTheSameBits) {
  const Outcome alone = fly(RunMode::deterministic, GetParam());
  ASSERT_EQ(alone.odometry.size(), 44u);
  // Poses must be there, or the feedback from the estimator to the frontend is not exercised.
  ASSERT_GT(alone.with_pose, 20);
  for (int run = 0; run < 2; ++run) {
    const Outcome threaded = fly(RunMode::threaded, GetParam());
    ASSERT_EQ(threaded.odometry.size(), alone.odometry.size());
    for (std::size_t i = 0; i < alone.odometry.size(); ++i) ASSERT_EQ(threaded.odometry[i], alone.odometry[i]) << i;
    EXPECT_EQ(threaded.keyframes, alone.keyframes);
  }
}

TEST_P(Frontends, TheMotionIsMeasured) {
  const Outcome outcome = fly(RunMode::threaded, GetParam());
  ASSERT_TRUE(outcome.last.health.has_pose());
  const double truth_m = sway_m(outcome.last.t.seconds());
  ASSERT_GT(truth_m, 0.05);
  EXPECT_NEAR(outcome.last.T_WB.p.norm(), truth_m, 0.03);
}

TEST(ImuHealth, ASilentImuIsNeverGoodAgain) {
  SystemOptions options;
  options.frontend.kind = "klt";
  System system = *System::create(options, small_rig());
  int good_before = 0, good_after = 0, gaps_named = 0;
  system.on_odometry([&](const Odometry& o) {
    const bool silent = o.t.seconds() > 3.06;
    ++(silent ? good_after : good_before) -= o.health.state != HealthState::good;
    gaps_named += silent && o.health.reason == HealthReason::imu_gap;
  });
  for (const SensorEvent& event : sway(160)) {
    const auto* reading = std::get_if<ImuSample>(&event);
    if (reading != nullptr && reading->t.seconds() > 3) continue;
    ASSERT_TRUE(system.push(event));
  }
  ASSERT_TRUE(system.finish());
  EXPECT_GT(good_before, 30);
  EXPECT_EQ(good_after, 0);
  EXPECT_GT(gaps_named, 10);
}

TEST(SystemParts, AnUnknownFrontendOrAnOptionOutOfRangeIsAnErrorAtOnce) {
  SystemOptions options;
  options.frontend.kind = "surf";
  EXPECT_FALSE(System::create(options, small_rig()));
  options = {};
  options.estimator.max_iterations = 0;
  const Result<System> system = System::create(options, small_rig());
  ASSERT_FALSE(system);
  EXPECT_NE(system.error().message.find("estimator.max_iterations"), std::string::npos);
}

/// Flies 8 s, of which one camera delivers nothing from 2.5 s to `back_s`. The largest error of the distance from the start, m.
double error_without(bool left, double back_s, const std::string& frontend) {
  static const std::vector<SensorEvent> all = sway(160);
  System system = system_of(RunMode::deterministic, {}, frontend);
  double worst_m = 0;
  system.on_odometry([&](const Odometry& o) {
    const double t_s = (o.t - Time{}).seconds();
    EXPECT_EQ(o.reset_counter, 0u);
    EXPECT_TRUE(o.health.has_pose() || t_s < 0.6) << t_s << " s: " << to_string(o.health.reason);
    const bool alone = t_s >= 2.5 && t_s<back_s, again = t_s> back_s + 0.2;
    const std::uint8_t dead = left ? 0b01 : 0b10;
    const Health expected = alone ? Health{HealthState::degraded, HealthReason::one_camera, dead} : Health{HealthState::good};
    if (alone || again) {
      EXPECT_EQ(o.health, expected) << t_s << " s: " << to_string(o.health.reason);
    }
    if (o.health.has_pose()) worst_m = std::max(worst_m, std::abs(o.T_WB.p.norm() - sway_m(t_s)));
  });
  for (SensorEvent event : all) {
    if (auto* frame = std::get_if<StereoFrame>(&event);
        frame && (frame->t - Time{}).seconds() >= 2.5 && (frame->t - Time{}).seconds() < back_s)
      frame->set_image(left ? 0 : 1, nullptr);
    EXPECT_TRUE(system.push(std::move(event)));
  }
  EXPECT_TRUE(system.finish().ok());
  return worst_m;
}

class OneCamera : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(System, OneCamera, testing::Values("klt", "orb", "boost"));

TEST_P(OneCamera, FliesOnWhicheverIsDeadForSecondsOrForEver) {
  for (const double back_s : {6.0, 1e9}) {
    const double left_m = error_without(true, back_s, GetParam()), right_m = error_without(false, back_s, GetParam());
    std::printf("%s, back at %g s: left dead %.4f m, right dead %.4f m\n", GetParam(), back_s, left_m, right_m);
    EXPECT_LT(left_m, 0.03);
    EXPECT_LT(left_m, 2 * right_m + 0.01);
  }
}

TEST(SystemInput, AnImageOfAnotherSizeCountsAsMissing) {
  System system = system_of(RunMode::deterministic);
  std::vector<Health> health;
  system.on_odometry([&](const Odometry& o) { health.push_back(o.health); });
  const auto good = std::make_shared<Image>(kWidth, kHeight), other = std::make_shared<Image>(kWidth, kHeight - 1);
  for (int k = 0; k <= 400; ++k) {
    ASSERT_TRUE(system.push(ImuSample{Time{k * kMs}, Vec3::Zero(), Vec3(0, -9.81, 0)}));
    if (k != 100 && k != 150 && k != 200) continue;
    ASSERT_TRUE(system.push(StereoFrame{Time{k * kMs}, {k == 150 ? good : other, k == 100 ? good : other}}));
  }
  ASSERT_TRUE(system.finish().ok());
  using enum HealthReason;
  ASSERT_EQ(health.size(), 3u);
  EXPECT_EQ(health[0], (Health{HealthState::initialising, one_camera, 0b01}));
  EXPECT_EQ(health[1], (Health{HealthState::initialising, one_camera, 0b10}));
  EXPECT_EQ(health[2], (Health{HealthState::initialising, no_images}));
}

TEST(SystemParts, ARigThatCannotFlyIsRefused) {
  StereoRig silent = small_rig();
  silent.imu_noise.gyro_noise_density_radps_rthz = 0;
  const Result<System> without_noise = System::create({}, silent);
  ASSERT_FALSE(without_noise);
  EXPECT_EQ(without_noise.error().message, "the rig: the gyroscope's noise density is 0, not positive");
  EXPECT_FALSE(System::create({}, StereoRig{}));
}

TEST(SystemParts, AStandingVehicleWithoutAnUpIsRefused) {
  SystemOptions options;
  options.estimator.standing = {.tilt_rad = 0.005, .up_x = 0, .up_y = 0, .up_z = 0};
  const Result<System> made = System::create(options, small_rig());
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().message, "estimator.standing: up_x, up_y and up_z are all zero: none says where up is");
}

TEST(SystemParts, ACustomFrontendGetsStampsReadingsAndLandmarksInOrder) {
  class Recorder final : public Frontend {
   public:
    explicit Recorder(std::vector<std::int64_t>& updates) : updates_(updates) {}
    TrackedFrame process(const SensorPacket&, const StatePrior&) override { return {}; }
    void locate(const LandmarkUpdate& update) override { updates_.push_back(update.sequence); }

   private:
    std::vector<std::int64_t>& updates_;
  };
  std::vector<std::int64_t> updates;
  System system = system_of(RunMode::deterministic, {.frontend = std::make_unique<Recorder>(updates)});
  std::vector<TrackedFrame> frames;
  system.on_tracked_frame([&](const TrackedFrame& f) { frames.push_back(f); });
  push_all(system, recording());
  ASSERT_TRUE(system.finish());
  ASSERT_EQ(frames.size(), 44u);
  EXPECT_EQ(frames[7].id.value, 7);
  EXPECT_EQ(frames[7].t.ns, 350 * kMs);
  EXPECT_EQ(frames[7].imu.samples.size(), 11u);
  ASSERT_EQ(updates.size(), 42u);  // those of the last two frames come too late for any image
  for (std::size_t i = 0; i < updates.size(); ++i) EXPECT_EQ(updates[i], static_cast<std::int64_t>(i));
}

}  // namespace system_test
}  // namespace fbvins
