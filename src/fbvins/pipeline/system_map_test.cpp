// SPDX-License-Identifier: Apache-2.0
// The system with a map beside it, and with known time offsets: threads give the same bits, and the odometry does not change.
#include <gtest/gtest.h>

#include <condition_variable>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/vocabulary_file.hpp"
#include "tests/support/sway_recording.hpp"

namespace fbvins {
namespace system_map_test {

using namespace sway_recording;

std::unique_ptr<LoopCloser> loop_closer(const StereoRig& rig = small_rig(), PlaceMap map = {}) {
  auto vocabulary = Vocabulary::open(shipped_vocabulary());
  EXPECT_TRUE(vocabulary.ok()) << vocabulary.error().message;
  return std::make_unique<LoopCloser>(rig, LoopOptions{}, std::move(*vocabulary), std::move(map));
}

struct MapOutcome {
  std::vector<std::string> odometry, updates;
  std::string map;
  int loops = 0, moved = 0;
};

/// In a building: the camera's y points down, and it looks along x.
Pose<A, B> in_building(double t_s) {
  Mat3 R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {R, Vec3(10, 5 - sway_m(t_s), 2)};
}

/// A tag on the wall, seen at 10 Hz beside the images; every fifth one is taken for another.
std::vector<Anchor> tags(int images) {
  std::vector<Anchor> out;
  const Pose<A, Tag> on_wall(Quat(0.5, 0.5, -0.5, -0.5), Vec3(12, 5, 2)), other(Quat::Identity(), Vec3(3, 1, 2));
  for (int k = 0; k < images / 2; ++k) {
    TagAnchor tag{.t = Time{(100 * k + 20) * kMs}, .T_AT = k % 5 == 4 ? other : on_wall};
    tag.T_BT = in_building(tag.t.seconds()).inverse() * on_wall;
    tag.covariance.diagonal() << Vec3::Constant(1e-4), Vec3::Constant(1e-4);
    out.push_back(tag);
  }
  return out;
}

MapOutcome fly_with_map(RunMode mode, bool with_map, const std::vector<SensorEvent>& events,
                        const std::vector<Anchor>& anchors = {}) {
  const std::unique_ptr<LoopCloser> loop = with_map ? loop_closer() : nullptr;
  System system = system_of(mode, {.mapper = loop.get()});
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
    outcome.moved += u.M_moved && u.anchored;  // else it is levelled
  });
  std::size_t next = 0;
  for (const SensorEvent& event : events) {
    const Time t = stamp_of(event);
    for (; next < anchors.size() && stamp_of(anchors[next]) <= t; ++next) EXPECT_TRUE(system.push(anchors[next]));
    EXPECT_TRUE(system.push(event));
  }
  EXPECT_FALSE(system.push(HeightAnchor{.sigma_m = -1})) << "it is impossible, and nothing else happens";
  EXPECT_TRUE(system.finish().ok());
  EXPECT_FALSE(system.push(HeightAnchor{}));
  if (loop) outcome.map = serialise_map(loop->map());
  return outcome;
}

TEST(LoopClosureInTheSystem, ThreadsGiveTheSameMapAndTheOdometryDoesNotChange) {
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

TEST(LoopClosureInTheSystem, AnchorsMakeMTheBuildingsFrame) {
  const std::vector<SensorEvent> events = sway(130);
  const MapOutcome without = fly_with_map(RunMode::deterministic, true, events);
  const MapOutcome alone = fly_with_map(RunMode::deterministic, true, events, tags(130));
  const MapOutcome threaded = fly_with_map(RunMode::threaded, true, events, tags(130));
  EXPECT_EQ(without.moved, 0);
  EXPECT_EQ(alone.moved, 1);
  EXPECT_EQ(alone.odometry, without.odometry) << "anchors never move W";
  EXPECT_EQ(threaded.updates, alone.updates);
  EXPECT_EQ(threaded.map, alone.map);
  const auto map = parse_map(std::as_bytes(std::span(alone.map)), "map");
  ASSERT_TRUE(map.ok());
  ASSERT_TRUE(map->anchored);
  EXPECT_GT(map->anchors.size(), 30u);
  for (const MapKeyframe& k : map->keyframes()) {
    const Pose<A, B> truth = in_building(k.t.seconds());
    EXPECT_LT((k.T_MB.p - truth.p).norm(), 0.01) << k.t.seconds();
    EXPECT_LT(so3_log(k.T_MB.q.conjugate() * truth.q).norm(), 0.01) << k.t.seconds();
  }
}

/// A flight of one camera or of two. The map, and where the body was in M at each keyframe from which on it was known.
struct Flown {
  std::string map;
  std::vector<std::pair<Time, Pose<M, B>>> in_M;
  int loops = 0;
};

/// Cameras that deliver images. A flight starts by a left one, which may die.
constexpr int kLeft = 1, kRight = 2, kBoth = kLeft | kRight, kFramesUntilLeftDies = 40;

Flown fly_in(PlaceMap map, int cameras) {
  const StereoRig rig = cameras == 1 ? with_one_camera(small_rig()) : small_rig();
  const std::unique_ptr<LoopCloser> loop = loop_closer(rig, std::move(map));
  System system = *System::create({}, rig, RunMode::deterministic, {.mapper = loop.get()});
  Flown flown;
  std::map<std::int64_t, std::pair<Time, Pose<G, B>>> keyframes;
  system.on_keyframe([&](const Keyframe& k) { keyframes[k.id.value] = {k.t, k.gauge.T_GB}; });
  system.on_map_update([&](const MapUpdate& u) {
    flown.loops += static_cast<int>(u.loops.size());
    const auto& [t, T_GB] = keyframes[u.frame.value];
    if (u.localised) flown.in_M.push_back({t, u.T_MG * T_GB});
  });
  int frames = 0;
  for (SensorEvent event : sway(150)) {
    if (auto* frame = std::get_if<StereoFrame>(&event); frame != nullptr) {
      if ((cameras & kLeft) == 0 && ++frames > kFramesUntilLeftDies) frame->set_image(0, nullptr);
      if ((cameras & kRight) == 0) frame->set_image(1, nullptr);
    }
    EXPECT_TRUE(system.push(std::move(event)));
  }
  EXPECT_TRUE(system.finish().ok());
  loop->finish();
  flown.map = serialise_map(loop->map());
  return flown;
}

/// A map does not depend on the camera that made it: one has its depths from earlier keyframes, a pair from stereo.
TEST(MapOfOneCamera, ClosesLoopsAndIsSharedWithTheOtherAndWithAPair) {
  Flown first[4];
  for (const int cameras : {kLeft, kRight, kBoth}) {
    first[cameras] = fly_in({}, cameras);
    EXPECT_GT(first[cameras].loops, 0) << cameras;
  }
  for (const int mapped : {kLeft, kRight, kBoth})
    for (const int flies : {kLeft, kRight, kBoth}) {
      if (mapped == flies && mapped != kLeft) continue;
      auto map = parse_map(std::as_bytes(std::span(first[mapped].map)), "map");
      ASSERT_TRUE(map.ok());
      const MapKeyframe& k = map->keyframes()[map->size() / 2];
      const Vec3 along = k.T_MB.q * Vec3::UnitX(), at = k.T_MB.p - sway_m(k.t.seconds()) * along;
      const Flown again = fly_in(std::move(*map), flies);
      ASSERT_GT(again.in_M.size(), 5u) << flies << " in a map of " << mapped;
      for (const auto& [t, T_MB] : again.in_M)
        EXPECT_LT((T_MB.p - at - sway_m(t.seconds()) * along).norm(), 0.05)
            << flies << " in a map of " << mapped << ", " << t.seconds() << " s";
    }
}

/// With the IMU's clock beside the cameras', and the offset known, everything is the same to the last bit: the odometry with
/// its re-observed landmarks, and the map with its readings.
TEST(TimeOffset, AKnownOffsetChangesNothing) {
  const std::vector<SensorEvent> events = sway(130);
  const auto fly_at = [&](Duration offset) {
    StereoRig rig = small_rig();
    rig.time_offset_s = offset.seconds();
    const std::unique_ptr<LoopCloser> loop = loop_closer();
    SystemOptions options;
    options.frontend.kind = "orb";
    System system = *System::create(options, rig, RunMode::deterministic, {.mapper = loop.get()});
    std::string bytes;
    int known = 0, with_readings = 0;
    system.on_odometry([&](const Odometry& o) { bytes += bytes_of(o), known += o.stats.known_landmarks; });
    system.on_keyframe([&](const Keyframe& k) { with_readings += !k.imu.segments.empty(); });
    // In order of arrival: a reading comes with its image, whatever it is stamped.
    for (SensorEvent event : events) {
      if (auto* reading = std::get_if<ImuSample>(&event)) reading->t = reading->t + offset;
      EXPECT_TRUE(system.push(std::move(event)));
    }
    EXPECT_TRUE(system.finish());
    EXPECT_GT(known, 0);
    EXPECT_GT(with_readings, 5);
    return std::pair(bytes, serialise_map(loop->map()));
  };
  const auto without = fly_at({});
  for (const double offset_s : {-0.05, 0.0123}) {
    const auto with = fly_at(Duration::from_seconds(offset_s));
    EXPECT_EQ(with.first == without.first, true) << offset_s;
    EXPECT_EQ(with.second == without.second, true) << offset_s;
  }
}

/// Where one camera's stamps are late, and its calibration says so, all is as if they were not.
TEST(TimeOffset, AKnownOffsetOfOneCameraChangesNothing) {
  const std::vector<SensorEvent> events = sway(60);
  const auto fly_at = [&](Duration late) {
    StereoRig rig = small_rig();
    rig.cameras[1].camera.set_own_times({.time_offset_s = -late.seconds()});
    System system = *System::create({}, rig, RunMode::deterministic);
    std::string bytes;
    system.on_odometry([&](const Odometry& o) { bytes += bytes_of(o); });
    for (SensorEvent event : events) {
      if (auto* frame = std::get_if<StereoFrame>(&event); frame != nullptr && late.ns != 0) frame->offsets.set(1, late);
      EXPECT_TRUE(system.push(std::move(event)));
    }
    EXPECT_TRUE(system.finish());
    return bytes;
  };
  EXPECT_EQ(fly_at(Duration{7'000'000}) == fly_at({}), true);
}

/// Takes no keyframe until it is told to go on.
class BlockedMapper final : public Mapper {
 public:
  MapUpdate process(const Keyframe& keyframe) override {
    std::unique_lock lock(mutex_);
    go_on_.wait(lock, [&] { return free_; });
    keyframes.push_back(keyframe);
    return {};
  }
  void go_on() {
    const std::lock_guard lock(mutex_);
    free_ = true;
    go_on_.notify_all();
  }
  std::vector<Keyframe> keyframes;

 private:
  std::mutex mutex_;
  std::condition_variable go_on_;
  bool free_ = false;
};

TEST(LiveSystemMode, AMapperThatIsBusyDoesNotHoldUpTheOdometry) {
  const std::vector<SensorEvent> events = sway(400);
  std::vector<std::string> alone, live;
  for (std::vector<std::string>* odometry : {&alone, &live}) {
    BlockedMapper mapper;
    System system =
        system_of(odometry == &live ? RunMode::live : RunMode::deterministic, {.mapper = odometry == &live ? &mapper : nullptr});
    system.on_odometry([&](const Odometry& o) { odometry->push_back(bytes_of(o)); });
    push_all(system, events);
    if (odometry == &alone) continue;
    while (odometry->size() + 2 < alone.size()) std::this_thread::yield();  // ends only if nothing waits for the mapper
    EXPECT_TRUE(mapper.keyframes.empty());
    EXPECT_GT(system.keyframes_left_out(), 0);
    const int left_out = system.keyframes_left_out();
    mapper.go_on();
    EXPECT_TRUE(system.finish());
    EXPECT_GE(mapper.keyframes.size(), 12u);
    for (std::size_t i = 1; i < mapper.keyframes.size(); ++i) {
      const std::vector<ImuSegment>& segments = mapper.keyframes[i].imu.segments;
      if (segments.empty()) continue;
      EXPECT_EQ(segments.front().samples.front().t, mapper.keyframes[i - 1].t) << "those of what was left out are there";
    }
    EXPECT_EQ(system.keyframes_left_out(), left_out);
  }
  EXPECT_EQ(live.size(), alone.size());
  EXPECT_EQ(live, alone);
}

}  // namespace system_map_test
}  // namespace fbvins
