// SPDX-License-Identifier: Apache-2.0
// However the system ends, no thread is left behind, and what failed is said.
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/sway_recording.hpp"

namespace fbvins {
namespace system_failure_test {

using namespace sway_recording;

/// Finds no features, and throws at a frame.
class ThrowingFrontend final : public Frontend {
 public:
  explicit ThrowingFrontend(std::int64_t at) : at_(at) {}
  TrackedFrame process(const SensorPacket& packet, const StatePrior&) override {
    if (packet.id.value == at_) throw std::runtime_error("the lens fell off");
    return {};
  }

 private:
  std::int64_t at_;
};

/// Counts keyframes, and throws at one.
class ThrowingMapper final : public Mapper {
 public:
  explicit ThrowingMapper(int at) : at_(at) {}
  MapUpdate process(const Keyframe&) override {
    if (++calls == at_) throw std::runtime_error("no room for the map");
    return {};
  }
  int calls = 0;

 private:
  int at_;
};

class Modes : public testing::TestWithParam<RunMode> {};
INSTANTIATE_TEST_SUITE_P(System, Modes, testing::Values(RunMode::deterministic, RunMode::threaded));

/// Pushes until the system refuses; the number of the newest image then.
std::int64_t push_until_refused(System& system, const std::vector<SensorEvent>& events, Result<void>& refused) {
  std::int64_t image = -1;
  for (const SensorEvent& event : events) {
    image += std::holds_alternative<StereoFrame>(event);
    refused = system.push(event);
    if (!refused) break;
  }
  return image;
}

void expect_stage_failed(const Result<void>& result, const std::string& sentence) {
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::stage_failed);
  EXPECT_EQ(result.error().message, sentence);
}

TEST_P(Modes, AStageThatThrowsAtFrame50IsSeenByFrame52) {
  const std::vector<SensorEvent> events = sway(70);
  for (const std::string stage : {"frontend", "estimator", "callback"}) {
    SystemParts parts;
    if (stage == "frontend") parts.frontend = std::make_unique<ThrowingFrontend>(50);
    System system = system_of(GetParam(), std::move(parts));
    std::int64_t newest = -1;
    const auto throw_at_50 = [&](FrameId id) {
      newest = id.value;
      if (id.value == 50 && stage != "frontend") throw std::runtime_error("the lens fell off");
    };
    if (stage == "callback") system.on_odometry([&](const Odometry& o) { throw_at_50(o.id); });
    else system.on_tracked_frame([&](const TrackedFrame& f) { throw_at_50(f.id); });  // on the estimator's thread
    Result<void> refused;
    EXPECT_LE(push_until_refused(system, events, refused), 52);
    const std::string sentence =
        (stage == "frontend" ? "the frontend" : "the estimator") + std::string(" failed: the lens fell off");
    expect_stage_failed(refused, sentence);
    expect_stage_failed(system.status(), sentence);
    expect_stage_failed(system.push(events.back()), sentence);
    expect_stage_failed(system.finish(), sentence);
    expect_stage_failed(system.finish(), sentence);
    // Nothing is processed after a failed stage, not even what waited for the next one.
    EXPECT_LE(newest, stage == "frontend" ? 49 : 50);
    EXPECT_GE(newest, stage == "frontend" ? 48 : 50);
  }
}

TEST_P(Modes, AMapperThatThrowsIsSeenByTheCaller) {
  ThrowingMapper mapper(2);
  System system = system_of(GetParam(), {.mapper = &mapper});
  const std::vector<SensorEvent> events = sway(200);
  Result<void> refused;
  push_until_refused(system, events, refused);
  expect_stage_failed(refused, "the mapper failed: no room for the map");
  expect_stage_failed(system.finish(), "the mapper failed: no room for the map");
  EXPECT_EQ(mapper.calls, 2);
}

TEST_P(Modes, WhatIsNotAStdExceptionIsCaughtAsWell) {
  System system = system_of(GetParam());
  system.on_odometry([](const Odometry&) { throw 42; });
  Result<void> refused;
  push_until_refused(system, recording(), refused);
  EXPECT_FALSE(refused);
  EXPECT_EQ(system.finish().error().code, ErrorCode::stage_failed);
}

TEST_P(Modes, DestructionAndMovingAtAnyTimeNeitherHangNorThrow) {
  for (const std::size_t events : {0u, 1u, 2u, 25u, 90u}) {
    System system = system_of(GetParam());
    for (std::size_t i = 0; i < events; ++i) ASSERT_TRUE(system.push(recording()[i]));
    System moved = std::move(system);
    for (std::size_t i = events; i < events + 5; ++i) ASSERT_TRUE(moved.push(recording()[i]));
  }
  System failing = system_of(GetParam());
  failing.on_odometry([](const Odometry&) { throw std::runtime_error("no"); });
  for (std::size_t i = 0; i < 40; ++i) (void)failing.push(recording()[i]);
}

TEST_P(Modes, FinishFlushesAndMayBeCalledTwice) {
  System system = system_of(GetParam());
  int frames = 0;
  system.on_odometry([&](const Odometry&) { ++frames; });
  const Wall wall;
  const auto image = [&](int k) { return StereoFrame{Time{50 * kMs * k}, {wall.seen_from(0), wall.seen_from(kBaseline)}}; };
  for (int k = 0; k < 4; ++k) ASSERT_TRUE(system.push(image(k)));
  EXPECT_TRUE(system.finish().ok());
  EXPECT_EQ(frames, 4);  // no reading ever came
  EXPECT_TRUE(system.finish().ok());
  EXPECT_EQ(system.input_counts().images, 4);
  EXPECT_EQ(system.push(image(4)).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(frames, 4);
}

}  // namespace system_failure_test
}  // namespace fbvins
