// SPDX-License-Identifier: Apache-2.0
// The whole system: threads give the same bits as without them, and however it ends none is left behind.
#include "fbvins/pipeline/system.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "fbvins/features/noise_texture.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/vocabulary_file.hpp"

namespace fbvins {
namespace system_test {

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

/// The results in an odometry, as bytes.
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

System system_of(RunMode mode, SystemParts parts = {}, const std::string& frontend = "klt") {
  SystemOptions options;
  options.frontend.kind = frontend;
  Result<System> system = System::create(options, small_rig(), mode, std::move(parts));
  EXPECT_TRUE(system.ok()) << system.error().message;
  return std::move(*system);
}

void push_all(System& system, const std::vector<SensorEvent>& events) {
  for (const SensorEvent& event : events) ASSERT_TRUE(system.push(event));
}

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

std::unique_ptr<LoopCloser> loop_closer() {
  auto vocabulary = Vocabulary::open(shipped_vocabulary());
  EXPECT_TRUE(vocabulary.ok()) << vocabulary.error().message;
  return std::make_unique<LoopCloser>(small_rig(), LoopOptions{}, std::move(*vocabulary));
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
    outcome.moved += u.M_moved.has_value();
  });
  std::size_t next = 0;
  for (const SensorEvent& event : events) {
    const Time t = std::visit([](const auto& e) { return e.t; }, event);
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
    rig.right.set_own_times({.time_offset_s = -late.seconds()});
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
      (left ? frame->left : frame->right).reset();
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
    ASSERT_TRUE(system.push(StereoFrame{Time{k * kMs}, k == 150 ? good : other, k == 100 ? good : other}));
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
  const auto image = [&](int k) { return StereoFrame{Time{50 * kMs * k}, wall.seen_from(0), wall.seen_from(kBaseline)}; };
  for (int k = 0; k < 4; ++k) ASSERT_TRUE(system.push(image(k)));
  EXPECT_TRUE(system.finish().ok());
  EXPECT_EQ(frames, 4);  // no reading ever came
  EXPECT_TRUE(system.finish().ok());
  EXPECT_EQ(system.input_counts().images, 4);
  EXPECT_EQ(system.push(image(4)).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(frames, 4);
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
