// SPDX-License-Identifier: Apache-2.0
// The threads of the whole: same bits as without them, and no way of ending them leaves one behind.
#include "fbvins/pipeline/system.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "fbvins/features/noise_texture.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/vocabulary_file.hpp"

namespace fbvins {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr double kFocal = 200, kDepth = 2.0, kBaseline = 0.1;  // px, m, m
constexpr std::int64_t kMs = 1'000'000;

/// B is the left camera: x right, y down, z forward.
StereoRig small_rig() {
  StereoRig rig;
  const Camera camera(PinholeRadtan{.fx = kFocal, .fy = kFocal, .cx = 160, .cy = 120}, kWidth, kHeight);
  rig.left = rig.right = camera;
  rig.T_BC1.p = Vec3(kBaseline, 0, 0);
  return rig;
}

/// Metres to the right of the start: at rest for a second, then swaying 0.3 m twice in three seconds.
double sway_m(double t_s) { return t_s < 1 ? 0 : 0.15 * (1 - std::cos(4 * std::numbers::pi / 3 * (t_s - 1))); }
double sway_mps2(double t_s) {
  const double w = 4 * std::numbers::pi / 3;
  return t_s < 1 ? 0 : 0.15 * w * w * std::cos(w * (t_s - 1));
}

/// A textured wall two metres ahead, seen by a camera that slides along it.
class Wall {
 public:
  Wall()
      : wall_(render_texture(
            480, kHeight, NoiseTexture(3, 24), [](const Vec2& p) { return p; }, 120, 45)) {}

  std::shared_ptr<const Image> seen_from(double x_m) const {
    auto image = std::make_shared<Image>(kWidth, kHeight);
    const double shift = x_m * kFocal / kDepth + 20;
    const int whole = static_cast<int>(shift);
    const double part = shift - whole;
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u)
        image->at(u, v) =
            static_cast<std::uint8_t>(std::lround((1 - part) * wall_.at(u + whole, v) + part * wall_.at(u + whole + 1, v)));
    }
    return image;
  }

 private:
  Image wall_;
};

/// Events in order of time: 20 Hz images, 200 Hz readings.
std::vector<SensorEvent> sway(int images) {
  const Wall wall;
  std::vector<SensorEvent> events;
  for (int k = 0; k <= (images - 1) * 10; ++k) {
    const double t_s = 0.005 * k;
    const Time t{5 * kMs * k};
    events.push_back(ImuSample{t, Vec3::Zero(), Vec3(sway_mps2(t_s), -9.81, 0)});
    if (k % 10 == 0) events.push_back(StereoFrame{t, wall.seen_from(sway_m(t_s)), wall.seen_from(sway_m(t_s) + kBaseline)});
  }
  return events;
}

const std::vector<SensorEvent>& recording() {
  static const std::vector<SensorEvent> events = sway(44);
  return events;
}

template <class Matrix>
void append(std::string& bytes, const Matrix& m) {
  bytes.append(reinterpret_cast<const char*>(m.data()), sizeof(*m.data()) * static_cast<std::size_t>(m.size()));
}

/// Everything of an odometry that is a result, as bytes.
std::string bytes_of(const Odometry& o) {
  std::string bytes = std::to_string(o.id.value) + " " + std::to_string(o.t.ns) + " " +
                      std::to_string(static_cast<int>(o.health.state)) + " " + std::to_string(o.stats.iterations) + " ";
  append(bytes, o.T_WB.p);
  append(bytes, o.T_WB.q.coeffs());
  append(bytes, o.v_WB);
  append(bytes, o.bias.gyro_radps);
  append(bytes, o.bias.accel_mps2);
  append(bytes, o.pose_covariance);
  return bytes;
}

struct Outcome {
  std::vector<std::string> odometry;
  int with_pose = 0;
  std::int64_t keyframes = 0;
  Odometry last;
};

Outcome fly(RunMode mode, const std::string& frontend) {
  Config config;
  config.frontend.kind = frontend;
  Outcome outcome;
  System system(config, small_rig(), mode);
  system.on_keyframe([&](const Keyframe&) { ++outcome.keyframes; });
  system.on_odometry([&](const Odometry& o) {
    outcome.odometry.push_back(bytes_of(o));
    outcome.with_pose += o.health.has_pose();
    outcome.last = o;
  });
  for (const SensorEvent& event : recording()) system.push(event);
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

TEST_P(Frontends, TheSwayIsMeasured) {
  const Outcome outcome = fly(RunMode::threaded, GetParam());
  ASSERT_TRUE(outcome.last.health.has_pose());
  const double truth_m = sway_m(outcome.last.t.seconds());
  ASSERT_GT(truth_m, 0.05);
  EXPECT_NEAR(outcome.last.T_WB.p.norm(), truth_m, 0.03);
}

std::unique_ptr<LoopCloser> loop_closer() {
  auto vocabulary = Vocabulary::open(shipped_vocabulary());
  EXPECT_TRUE(vocabulary.ok()) << vocabulary.error().message;
  return std::make_unique<LoopCloser>(small_rig(), LoopOptions{}, std::move(*vocabulary));
}

struct MapOutcome {
  std::vector<std::string> odometry, updates;
  std::string map;
  int loops = 0;
};

MapOutcome fly_with_map(RunMode mode, bool with_map, const std::vector<SensorEvent>& events) {
  System system({}, small_rig(), mode, with_map ? loop_closer() : nullptr);
  MapOutcome outcome;
  std::int64_t newest_update = 0;
  system.on_odometry([&](const Odometry& o) { outcome.odometry.push_back(bytes_of(o)); });
  system.on_map_update([&](const MapUpdate& u) {
    std::string bytes = std::to_string(u.frame.value) + " " + std::to_string(u.applies_from.value) + " ";
    append(bytes, u.T_MW.p);
    append(bytes, u.T_MW.q.coeffs());
    outcome.updates.push_back(bytes);
    outcome.loops += static_cast<int>(u.loops.size());
    EXPECT_GT(u.applies_from, u.frame);
    EXPECT_GE(u.applies_from.value, newest_update);
    newest_update = u.applies_from.value;
  });
  for (const SensorEvent& event : events) system.push(event);
  EXPECT_TRUE(system.finish().ok());
  if (system.loop() != nullptr) outcome.map = serialise_map(system.loop()->map());
  return outcome;
}

TEST(LoopClosureInTheSystem, ThreadsGiveTheSameMapAndTheOdometryDoesNotFeelIt) {
  const std::vector<SensorEvent> events = sway(130);  // comes by the same places again and again
  const MapOutcome without = fly_with_map(RunMode::deterministic, false, events);
  const MapOutcome alone = fly_with_map(RunMode::deterministic, true, events);
  const MapOutcome threaded = fly_with_map(RunMode::threaded, true, events);
  EXPECT_TRUE(without.updates.empty());
  EXPECT_EQ(alone.odometry, without.odometry);
  EXPECT_EQ(threaded.odometry, without.odometry);
  EXPECT_GT(alone.loops, 0);
  EXPECT_EQ(threaded.updates, alone.updates);
  EXPECT_EQ(threaded.map, alone.map);
}

class Modes : public testing::TestWithParam<RunMode> {};
INSTANTIATE_TEST_SUITE_P(System, Modes, testing::Values(RunMode::deterministic, RunMode::threaded));

TEST_P(Modes, AnExceptionInAStageIsAnErrorOfFinish) {
  for (const bool first_callback : {true, false}) {
    System system(Config{}, small_rig(), GetParam());
    int calls = 0;
    const auto fail_at_the_third = [&] {
      if (++calls == 3) throw std::runtime_error("the disk is full");
    };
    if (first_callback) system.on_tracked_frame([&](const TrackedFrame&) { fail_at_the_third(); });
    else system.on_odometry([&](const Odometry&) { fail_at_the_third(); });
    for (const SensorEvent& event : recording()) system.push(event);
    const Result<void> end = system.finish();
    ASSERT_FALSE(end.ok());
    EXPECT_NE(end.error().message.find("the disk is full"), std::string::npos);
    EXPECT_EQ(calls, 3);  // nothing is processed behind a failed stage
  }
}

TEST_P(Modes, AnExceptionBehindTheLoopCloserIsAnErrorOfFinish) {
  System system({}, small_rig(), GetParam(), loop_closer());
  int calls = 0;
  system.on_map_update([&](const MapUpdate&) {
    ++calls;
    throw std::runtime_error("no room for the map");
  });
  for (const SensorEvent& event : recording()) system.push(event);
  const Result<void> end = system.finish();
  ASSERT_FALSE(end.ok());
  EXPECT_NE(end.error().message.find("no room for the map"), std::string::npos);
  EXPECT_EQ(calls, 1);
}

TEST_P(Modes, WhatIsNotAStdExceptionIsCaughtAsWell) {
  System system(Config{}, small_rig(), GetParam());
  system.on_odometry([](const Odometry&) { throw 42; });
  for (const SensorEvent& event : recording()) system.push(event);
  EXPECT_FALSE(system.finish().ok());
}

TEST_P(Modes, DestructionAtAnyTimeNeitherHangsNorThrows) {
  for (const std::size_t events : {0u, 1u, 2u, 25u, 90u}) {
    System system(Config{}, small_rig(), GetParam());
    for (std::size_t i = 0; i < events; ++i) system.push(recording()[i]);
  }
  System failing(Config{}, small_rig(), GetParam());
  failing.on_odometry([](const Odometry&) { throw std::runtime_error("no"); });
  for (std::size_t i = 0; i < 40; ++i) failing.push(recording()[i]);
}

TEST_P(Modes, FinishFlushesAndMayBeCalledTwice) {
  System system(Config{}, small_rig(), GetParam());
  int frames = 0;
  system.on_odometry([&](const Odometry&) { ++frames; });
  const Wall wall;
  for (int k = 0; k < 4; ++k) system.push(StereoFrame{Time{50 * kMs * k}, wall.seen_from(0), wall.seen_from(kBaseline)});
  EXPECT_TRUE(system.finish().ok());
  EXPECT_EQ(frames, 4);  // no reading ever came
  EXPECT_TRUE(system.finish().ok());
  EXPECT_EQ(system.input_counts().images, 4);
}

}  // namespace
}  // namespace fbvins
