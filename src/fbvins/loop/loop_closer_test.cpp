// SPDX-License-Identifier: Apache-2.0
// The stage on flights through a synthetic room of points: drift is corrected, look-alikes are refused, flights relocalise
// in maps, memory stays bounded, bits repeat.
#include "fbvins/loop/loop_closer.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "fbvins/core/rng.hpp"
#include "fbvins/loop/map_file.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace loop_closer_test {

using namespace test_room;

struct Outcome {
  double W_m = 0, causal_m = 0, after_m = 0;
  int accepted = 0, refused = 0;
};

using Poses = std::vector<Pose<M, B>>;

/// RMSE after the best turn about z and shift.
double error_m(const Poses& poses, const Poses& truth) {
  const Pose<M, M> T = nearest_to(truth, poses, 0);
  double sum = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) sum += (T * poses[i].p - truth[i].p).squaredNorm();
  return std::sqrt(sum / static_cast<double>(poses.size()));
}

Outcome run(LoopCloser& closer, const std::vector<Frame>& frames) {
  Outcome o;
  Trajectory<G> odometry;
  Poses truth, in_W, causal, after;
  for (const Frame& f : frames) {
    const MapUpdate u = closer.process(f.place, keyframe(FrameId{f.t.ns / 1000}, f.t, f.odometry));
    o.accepted += u.stats.accepted, o.refused += u.stats.refused;
    odometry.push_back({f.t, f.odometry});
    truth.push_back({f.truth.q, f.truth.p}), in_W.push_back({f.odometry.q, f.odometry.p});
    causal.push_back(u.T_MG * f.odometry);
  }
  closer.finish();
  for (const StampedPose<M>& p : closer.corrected(odometry)) after.push_back(p.T);
  o.W_m = error_m(in_W, truth), o.causal_m = error_m(causal, truth), o.after_m = error_m(after, truth);
  return o;
}

TEST(LoopCloser, TakesOutDriftAtOnceAndMoreAfterwards) {
  const auto frames = flight(room(1), 300, 0.004, 0.05, 2);
  LoopCloser closer(rig(), {}, vocabulary());
  const Outcome o = run(closer, frames);
  EXPECT_GT(o.W_m, 0.03);
  EXPECT_GT(o.accepted, 200);
  EXPECT_LT(o.causal_m, 0.65 * o.W_m);
  EXPECT_LT(o.after_m, 0.25 * o.W_m);
}

TEST(LoopCloser, MStaysWithTheManyAndNotWithItsFirstKeyframe) {
  auto frames = flight(room(1), 250, 0, 0, 3);
  const Vec3 error(0.04, 0, 0.02);  // of the first seconds, in which an odometry errs most
  for (std::size_t i = 0; i < 12; ++i) frames[i].odometry.p += (1 - static_cast<double>(i) / 12) * error;
  LoopCloser closer(rig(), {}, vocabulary());
  int optimised = 0;
  Vec3 moved = Vec3::Zero();
  for (const Frame& f : frames) {
    const MapUpdate u = closer.process(f.place, keyframe(FrameId{f.t.ns / 1000}, f.t, f.odometry));
    optimised += u.stats.optimised;
    moved = u.T_MG.p;
  }
  closer.finish();
  EXPECT_GT(optimised, 2);
  const auto &first = closer.map().keyframes()[0], &later = closer.map().keyframes()[100];
  EXPECT_LT((later.T_MB.p - first.T_MB.p - (frames[100].truth.p - frames[0].truth.p)).norm(), 0.025) << "loops correct it";
  EXPECT_LT(moved.norm(), 0.3 * error.norm()) << "and what came after it stays";
}

/// A keyframe without images, a second after the one before, with the readings since then of an IMU at rest.
Keyframe seconds_later(int number, double x_m, double yaw_rad = 0) {
  Keyframe k = keyframe(FrameId{number}, Time{} + Duration::from_seconds(number), {about_z(yaw_rad), Vec3(x_m, 0, 0)});
  const Time before = k.t - Duration::from_seconds(1);
  k.imu.segments = {{{{before, Vec3::Zero(), Vec3(0, 0, 9.81)}, {k.t, Vec3::Zero(), Vec3(0, 0, 9.81)}}, k.t - before}};
  static const auto plain = std::make_shared<const Image>(752, 480);
  k.images.set_image(0, plain);
  return k;
}

TEST(LoopCloser, AKeyframeWithoutImagesBecomesNoPlace) {
  LoopCloser closer(rig(), {}, vocabulary());
  closer.process(seconds_later(0, 0));
  for (int i = 1; i < 5; ++i) {
    Keyframe k = seconds_later(i, i);
    k.images.set_image(0, nullptr);
    EXPECT_TRUE(closer.process(k).localised);
  }
  EXPECT_EQ(closer.map().size(), 1u);
  closer.process(seconds_later(5, 5));
  EXPECT_EQ(closer.map().size(), 2u);
  ASSERT_EQ(closer.map().edges.size(), 1u);
  EXPECT_NEAR(closer.map().edges[0].T_from_to.p.x(), 5, 1e-9);
}

TEST(LoopCloser, AKeyframeNearTheNewestBecomesNoPlaceAndItsReadingsCount) {
  LoopCloser closer(rig(), {}, vocabulary());
  const auto places_after = [&](const Keyframe& k) {
    EXPECT_TRUE(closer.process(k).localised);
    return closer.map().size();
  };
  EXPECT_EQ(places_after(seconds_later(0, 0)), 1u);
  EXPECT_EQ(places_after(seconds_later(1, 0.06)), 1u);
  EXPECT_EQ(places_after(seconds_later(2, 0.05)), 1u);
  EXPECT_EQ(places_after(seconds_later(3, 0.3)), 2u);
  EXPECT_EQ(places_after(seconds_later(4, 0.3, 0.2)), 3u) << "it looks elsewhere";
  Keyframe unread = seconds_later(5, 0.31, 0.2);
  unread.imu.segments.clear();
  EXPECT_EQ(places_after(unread), 3u);
  EXPECT_EQ(places_after(seconds_later(6, 0.9)), 4u);
  for (int i = 7; i < 14; ++i) EXPECT_EQ(places_after(seconds_later(i, 0.9)), 4u) << "it hovers";
  EXPECT_EQ(places_after(seconds_later(14, 1.2)), 5u);
  const std::vector<MapEdge>& edges = closer.map().edges;
  ASSERT_EQ(edges.size(), 4u);
  ASSERT_TRUE(edges[0].imu && edges[1].imu);
  EXPECT_EQ(edges[0].imu->end() - edges[0].imu->begin(), Duration::from_seconds(3));
  EXPECT_EQ(edges[1].imu->end() - edges[1].imu->begin(), Duration::from_seconds(1));
  EXPECT_FALSE(edges[2].imu) << "readings are missing on the way";
  EXPECT_FALSE(edges[3].imu) << "eight seconds of readings say nothing";
}

TEST(LoopCloser, SameInputSameBytes) {
  const auto frames = flight(room(1), 200, 0.004, 0.05, 3);
  LoopCloser a(rig(), {}, vocabulary()), b(rig(), {}, vocabulary());
  run(a, frames), run(b, frames);
  EXPECT_EQ(serialise_map(a.map()), serialise_map(b.map()));
}

TEST(LoopCloser, TwoIdenticalShelvesAreNotOnePlace) {
  // Straight along a wall with the same shelf every 3.5 m; the odometry is good and says so.
  Rng shelf_rng(4), rng(5);
  World w;
  std::vector<Vec3> shelf;
  std::vector<Descriptor> looks;
  for (int i = 0; i < 500; ++i) {
    shelf.push_back({3.0 + shelf_rng.uniform(0, 0.6), shelf_rng.uniform(-1.7, 1.7), shelf_rng.uniform(0, 2.8)});
    looks.push_back(random_descriptor(shelf_rng));
  }
  for (int copy = 0; copy < 5; ++copy)
    for (std::size_t i = 0; i < shelf.size(); ++i)
      w.points.push_back(shelf[i] + Vec3(0, 3.5 * copy, 0)), w.looks.push_back(looks[i]);
  LoopOptions options;
  LoopCloser closer(rig(), options, vocabulary());
  PlaceVerifier by_sight(options.verification);
  int true_loops = 0, fooled = 0;
  std::vector<double> y;  // of every keyframe, by id
  Place first;
  for (int i = 0; i < 140; ++i) {
    const Pose<G, B> T(Quat::Identity(), Vec3(0, 0.1 * std::min(i, 140 - i), 1.4));  // there, and half of the way back
    Place place = seen(w, T, rng);
    if (i == 0) first = place;
    if (i == 35) {
      by_sight.set_query(place);
      fooled += by_sight.verify(first).has_value();
    }
    const MapUpdate u = closer.process(std::move(place), keyframe(FrameId{i}, Time{i * 200'000'000LL}, T));
    y.push_back(T.p.y());
    for (const LoopConstraint& l : u.loops) {
      const double flown = y[static_cast<std::size_t>(l.to.value)] - y[static_cast<std::size_t>(l.from.value)];
      EXPECT_NEAR(l.T_from_to.p.y(), flown, 0.1);  // the next shelf would be 3.5 m off
      ++true_loops;
    }
    EXPECT_LT((u.T_MG.p).norm(), 0.05);
  }
  EXPECT_EQ(fooled, 1) << "the shelves must look the same";
  EXPECT_GT(true_loops, 0);
}

TEST(LoopCloser, FindsItselfInASavedMapFromAnotherStartAndNeverInAStrangersMap) {
  LoopCloser first(rig(), {}, vocabulary());
  const auto mapped = flight(room(1), 250, 0, 0, 2);
  run(first, mapped);
  for (const std::uint64_t world : {1, 7}) {
    const std::string bytes = serialise_map(first.map());
    auto map = parse_map(std::as_bytes(std::span(bytes)), "map");
    ASSERT_TRUE(map.ok());
    LoopCloser again(rig(), {}, vocabulary(), std::move(*map));
    const Quat turned(Eigen::AngleAxisd(2.0, Vec3::UnitZ()));
    bool localised = false;
    for (const Frame& f : flight(room(world), 60, 0.001, 0.01, 9, 7.3)) {
      const Pose<G, B> in_other_W(Quat(turned * f.odometry.q), Vec3(turned * f.odometry.p + Vec3(5, -3, 1)));
      const MapUpdate u = again.process(f.place, keyframe(FrameId{f.t.ns}, f.t, in_other_W));
      if (!u.localised) continue;
      localised = true;
      const Pose<M, B> T_MB = u.T_MG * in_other_W;
      EXPECT_LT((T_MB.p - f.truth.p).norm(), 0.1);
    }
    EXPECT_EQ(localised, world == 1);
  }
}

TEST(LoopCloser, KidnappedAndStartedAgainItIsInTheSameMapWithinTwoSecondsAndSaysSo) {
  const World w = room(1);
  LoopCloser closer(rig(), {}, vocabulary());
  for (const Frame& f : flight(w, 120, 0, 0, 2)) {
    const MapUpdate u = closer.process(f.place, keyframe(FrameId{f.t.ns}, f.t, f.odometry));
    EXPECT_FALSE(u.found) << "it began the map";
  }
  // Somewhere else in the room, in an odometry frame of its own.
  const Pose<G, G> elsewhere(about_z(2.0), Vec3(5, -3, 1));
  int found = 0;
  double found_after_s = 99;
  const std::vector<Frame> again = flight(w, 20, 0.001, 0.01, 9, 30.1);
  for (const Frame& f : again) {
    const Pose<G, B> T_GB = elsewhere * f.odometry;
    const MapUpdate u = closer.process(f.place, keyframe(FrameId{f.t.ns}, f.t, T_GB, 1));
    if (u.found) ++found, found_after_s = (f.t - again[0].t).seconds();
    if (!u.localised) continue;
    EXPECT_LT(((u.T_MG * T_GB).p - f.truth.p).norm(), 0.1) << "the same M";
  }
  EXPECT_EQ(found, 1);
  EXPECT_LE(found_after_s, 2);
}

TEST(LoopCloser, RoundsInOneRoomDoNotGrowTheMapWithoutBound) {
  LoopOptions options;
  options.thin_above = 150;
  options.max_keyframes = 300;
  LoopCloser closer(rig(), options, vocabulary());
  std::size_t after_three = 0;
  const World w = room(1);
  const auto frames = flight(w, 1000, 0.001, 0.01, 4);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    closer.process(frames[i].place, keyframe(FrameId{static_cast<std::int64_t>(i)}, frames[i].t, frames[i].odometry));
    if (i == 400) after_three = serialise_map(closer.map()).size();
  }
  EXPECT_LT(serialise_map(closer.map()).size(), 1.4 * static_cast<double>(after_three));
  EXPECT_LE(closer.map().size(), 300u);
}

/// A restart with every keyframe: W has to be found in the map again and again. Returns how often it was.
int fly_with_restarts(LoopCloser& closer, const std::vector<Frame>& frames) {
  int localised = 0;
  for (std::size_t i = 0; i < frames.size(); ++i)
    localised += closer
                     .process(frames[i].place, keyframe(FrameId{static_cast<std::int64_t>(i)}, frames[i].t, frames[i].odometry,
                                                        static_cast<std::uint32_t>(i)))
                     .localised;
  return localised;
}

LoopOptions small_map() {
  LoopOptions options;
  options.max_keyframes = 25;
  return options;
}

TEST(LoopCloser, AMapOfSingleKeyframesKeepsItsLimitToo) {
  const auto frames = flight(room(1), 60, 0, 0, 2);
  // In a process of its own: one that never ends is killed by its alarm.
  const auto in_time = [&] {
    alarm(60);
    LoopCloser closer(rig(), small_map(), vocabulary());
    fly_with_restarts(closer, frames);
    _exit(closer.map().size() == 25 ? 0 : 1);
  };
  EXPECT_EXIT(in_time(), testing::ExitedWithCode(0), "");
}

TEST(LoopCloser, PosesOfASessionWhoseKeyframesAreGoneStayWhereTheyWere) {
  const auto frames = flight(room(1), 60, 0, 0, 2);
  LoopCloser closer(rig(), small_map(), vocabulary());
  const int localised = fly_with_restarts(closer, frames);
  int placed = 0;
  for (const Frame& f : frames) {
    const Trajectory<M> corrected = closer.corrected({{f.t, f.odometry}});
    if (corrected.empty()) continue;
    ++placed;
    EXPECT_LT((corrected[0].T.p - f.truth.p).norm(), 0.1);
  }
  EXPECT_GT(localised, 10);
  EXPECT_EQ(placed, localised);
}

}  // namespace loop_closer_test
}  // namespace fbvins
