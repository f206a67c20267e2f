// SPDX-License-Identifier: Apache-2.0
// The whole of live, with a frontend that sees a simulated flight: no images are needed, and the truth is exact.
#include "fbvins/live/live_system.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <latch>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "fbvins/estimator/estimator.hpp"
#include "tests/support/simulated_flight.hpp"

namespace fbvins {
namespace live_system_test {

using test::Motion;
using test::SimulatedFlight;

constexpr int kReadingsPerImage = 10;

/// Keeps all events, for a test to wait for.
class Watcher {
 public:
  void note(const LiveEvent& event) {
    const std::lock_guard lock(mutex_);
    events_.push_back(event);
    changed_.notify_all();
  }
  template <class Event>
  std::vector<Event> all() const {
    const std::lock_guard lock(mutex_);
    std::vector<Event> found;
    for (const LiveEvent& e : events_)
      if (const auto* event = std::get_if<Event>(&e)) found.push_back(*event);
    return found;
  }
  /// Waits until an event satisfies `wanted`; false after a minute.
  template <class Event, class Predicate>
  bool wait_for(const Predicate& wanted) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60), [&] {
      return std::any_of(events_.begin(), events_.end(), [&](const LiveEvent& e) {
        const auto* event = std::get_if<Event>(&e);
        return event != nullptr && wanted(*event);
      });
    });
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<LiveEvent> events_;
};

class WatcherSink final : public Sink {
 public:
  explicit WatcherSink(Watcher& watcher) : watcher_(watcher) {}
  std::string_view name() const override { return "watcher"; }
  Result<void> take(const LiveEvent& event) override {
    watcher_.note(event);
    return {};
  }

 private:
  Watcher& watcher_;
};

/// The features of the simulated flight at the packet's stamp.
class SeesTheFlight final : public Frontend {
 public:
  explicit SeesTheFlight(SimulatedFlight flight, std::function<void(FrameId)> before = {})
      : flight_(std::move(flight)), before_(std::move(before)) {}
  TrackedFrame process(const SensorPacket& packet, const StatePrior&) override {
    if (before_) before_(packet.id);
    const int k = static_cast<int>(std::lround((packet.frame.t - flight_.stamp(0)).seconds() * flight_.image_rate_hz));
    return flight_.frame(k);
  }

 private:
  SimulatedFlight flight_;
  std::function<void(FrameId)> before_;
};

struct Fixture {
  Motion motion{0.5, 0.3};
  SimulatedFlight flight{motion, 1};
  Watcher watcher;
  std::uint8_t pixel = 0;
  std::uint32_t first_reset_counter = 0;

  LiveSystem live(std::function<void(FrameId)> before = {}, LiveOptions options = {}) {
    auto made = LiveSystem::create({}, options, flight.rig, 1, {.frontend = std::make_unique<SeesTheFlight>(flight, before)},
                                   first_reset_counter);
    EXPECT_TRUE(made) << (made ? "" : made.error().message);
    made->add_sink(std::make_unique<WatcherSink>(watcher));
    return std::move(*made);
  }
  ImuSample reading(int k) const { return motion.sample(flight.stamp(0) + Duration::from_seconds(k * 0.005), flight.bias); }
  StereoFrame image(int k) {
    ++pixel;
    const auto left = std::make_shared<Image>(8, 8, pixel);
    return {flight.stamp(k), {left, std::make_shared<Image>(8, 8, static_cast<std::uint8_t>(pixel + 1))}};
  }
  /// Image k and the readings up to the next one; waits for the estimate, so that nothing is dropped.
  void play(LiveSystem& live, int first, int last) {
    for (int k = first; k < last; ++k) {
      live.input().push(image(k));
      for (int i = 0; i < kReadingsPerImage; ++i) live.input().push(reading(k * kReadingsPerImage + i));
      ASSERT_TRUE(watcher.wait_for<Odometry>([&](const Odometry& o) { return o.t == flight.stamp(k); })) << k;
    }
  }
};

TEST(LiveSystem, PublishesAPoseWithEveryReading) {
  Fixture f;
  LiveSystem live = f.live();
  f.play(live, 0, 60);
  ASSERT_TRUE(live.finish());
  const std::vector<LivePose> poses = f.watcher.all<LivePose>();
  ASSERT_EQ(poses.size(), 600u);
  for (std::size_t k = 1; k < poses.size(); ++k) EXPECT_EQ((poses[k].t - poses[k - 1].t).ns, 5'000'000);
  EXPECT_TRUE(poses.back().health.has_pose());
  const LiveStatus status = live.status();
  EXPECT_EQ(status.counts.images_estimated, 60);
  EXPECT_EQ(status.counts.images_dropped, 0);
  EXPECT_EQ(status.counts.imu, 600);
}

/// Another counter than the process before had tells who outlives both that W is a new frame.
TEST(LiveSystem, AllOutputsBeginWithTheFirstResetCounter) {
  Fixture f;
  f.first_reset_counter = 7;
  LiveSystem live = f.live();
  f.play(live, 0, 30);
  ASSERT_TRUE(live.finish());
  for (const LivePose& pose : f.watcher.all<LivePose>()) ASSERT_EQ(pose.reset_counter, 7u);
  for (const Odometry& o : f.watcher.all<Odometry>()) ASSERT_EQ(o.reset_counter, 7u);
  EXPECT_EQ(live.status().reset_counter, 7u);
  EXPECT_EQ(live.status().counts.resets, 0);
}

/// A new start on request gives a new W, which begins at the last pose in the old one.
TEST(LiveSystem, StartsAgainWhereItWas) {
  Fixture f;
  LiveSystem live = f.live();
  f.play(live, 0, 40);
  live.start_again();
  f.play(live, 40, 80);
  ASSERT_TRUE(live.finish());
  const std::vector<Odometry> all = f.watcher.all<Odometry>();
  ASSERT_EQ(all.size(), 80u);
  EXPECT_EQ(all[39].reset_counter, 0u);
  EXPECT_EQ(all[40].reset_counter, 1u);
  EXPECT_EQ(all[40].health.state, HealthState::initialising);
  EXPECT_EQ(all.back().reset_counter, 1u);
  const auto again = std::find_if(all.begin() + 40, all.end(), [](const Odometry& o) { return o.health.has_pose(); });
  ASSERT_NE(again, all.end());
  const double flown_m = (f.motion.state(again->t.seconds()).T_FB.p - f.motion.state(all[39].t.seconds()).T_FB.p).norm();
  EXPECT_LT((again->T_WB.p - all[39].T_WB.p).norm(), flown_m + 0.5);
  EXPECT_EQ(live.status().counts.resets, 1);
}

TEST(LiveSystem, ViewsAreMadeForThoseWhoLook) {
  struct Looker final : Sink {
    explicit Looker(std::atomic<bool>& now) : looks(now) {}
    std::string_view name() const override { return "looker"; }
    Result<void> take(const LiveEvent&) override { return {}; }
    bool wants_views() const override { return looks; }
    std::atomic<bool>& looks;
  };
  Fixture f;
  LiveSystem live = f.live();
  std::atomic<bool> looks{false};
  live.add_sink(std::make_unique<Looker>(looks));
  f.play(live, 0, 30);
  EXPECT_TRUE(f.watcher.all<LiveView>().empty());
  looks = true;
  f.play(live, 30, 40);
  looks = false;
  f.play(live, 40, 50);
  ASSERT_TRUE(live.finish());
  const std::vector<LiveView> views = f.watcher.all<LiveView>();
  ASSERT_EQ(views.size(), 10u);
  EXPECT_EQ(views.front().t, f.flight.stamp(30));
  EXPECT_FALSE(views.front().landmarks.empty());
  EXPECT_FALSE(views.front().features.empty());
}

/// Sinks get the sensor events as the estimator consumes them, so that a record can be run again.
TEST(LiveSystem, SinksGetTheSensorEventsThatTheEstimatorGets) {
  Fixture f;
  LiveSystem live = f.live();
  f.play(live, 0, 30);
  ASSERT_TRUE(live.finish());
  EXPECT_EQ(f.watcher.all<StereoFrame>().size(), 30u);
  EXPECT_EQ(f.watcher.all<ImuSample>().size(), 300u);
  EXPECT_EQ(f.watcher.all<Odometry>().size(), 30u);
}

TEST(LiveSystem, ABusyFrontendCostsImagesButNoReadings) {
  Fixture f;
  std::mutex gate;
  std::unique_lock closed(gate);
  LiveSystem live = f.live([&](FrameId id) {
    if (id.value >= 20) const std::lock_guard wait(gate);
  });
  f.play(live, 0, 20);
  for (int k = 20; k < 40; ++k) {
    live.input().push(f.image(k));
    for (int i = 0; i < kReadingsPerImage; ++i) live.input().push(f.reading(k * kReadingsPerImage + i));
  }
  // Poses at IMU rate go on although no image is worked on.
  EXPECT_TRUE(f.watcher.wait_for<LivePose>([&](const LivePose& p) { return p.t == f.reading(399).t; }));
  closed.unlock();
  ASSERT_TRUE(live.finish());
  const LiveCounts counts = live.status().counts;
  EXPECT_GE(counts.images_dropped, 10);
  EXPECT_EQ(counts.images_dropped + counts.images_estimated, 40);
  EXPECT_EQ(f.watcher.all<ImuSample>().size(), 400u);
  EXPECT_EQ(f.watcher.all<StereoFrame>().back().t, f.flight.stamp(39));
}

TEST(LiveSystem, WhatASlowSinkLosesIsCounted) {
  struct Hanging final : Sink {
    explicit Hanging(std::latch& released) : go(released) {}
    std::string_view name() const override { return "hanging"; }
    Result<void> take(const LiveEvent&) override {
      go.wait();
      return {};
    }
    std::latch& go;
  };
  Fixture f;
  LiveSystem live = f.live();
  std::latch go(1);
  live.add_sink(std::make_unique<Hanging>(go));
  f.play(live, 0, 40);
  EXPECT_GE(live.status().counts.events_lost, 40 - 33);  // 32 images may wait, and one be held
  go.count_down();
  ASSERT_TRUE(live.finish());
}

TEST(LiveSystem, SilentCamerasAreReportedWhileReadingsGoOn) {
  Fixture f;
  LiveOptions options;
  options.camera_silence_s = 0.02;
  LiveSystem live = f.live({}, options);
  f.play(live, 0, 40);
  // No image comes any more. Readings do, in wall time.
  for (int k = 400; k < 430; ++k) {
    live.input().push(f.reading(k));
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  const Health expected{HealthState::degraded, HealthReason::no_images};
  EXPECT_TRUE(f.watcher.wait_for<LiveStatus>([&](const LiveStatus& s) { return s.health == expected; }));
  EXPECT_TRUE(f.watcher.wait_for<LivePose>([&](const LivePose& p) { return p.health == expected; }));
  ASSERT_TRUE(live.finish());
}

TEST(LiveSystem, AStageThatThrowsIsTheStatus) {
  Fixture f;
  LiveSystem live = f.live([](FrameId id) {
    if (id.value == 5) throw std::runtime_error("the lens fell off");
  });
  std::latch told(1);
  live.on_failure([&] { told.count_down(); });
  f.play(live, 0, 5);
  for (int k = 5; k < 20; ++k) {
    live.input().push(f.image(k));
    for (int i = 0; i < kReadingsPerImage; ++i) live.input().push(f.reading(k * kReadingsPerImage + i));
  }
  told.wait();
  const Result<void> done = live.finish();
  ASSERT_FALSE(done);
  EXPECT_NE(done.error().message.find("the lens fell off"), std::string::npos);
  EXPECT_NE(live.status().problem.find("the lens fell off"), std::string::npos);
}

TEST(LiveSystem, EndsAtOnceWithoutAnyInput) {
  Fixture f;
  EXPECT_TRUE(f.live().finish());
  LiveSystem never_ended = f.live();
  never_ended.input().push(f.reading(0));
}

}  // namespace live_system_test
}  // namespace fbvins
