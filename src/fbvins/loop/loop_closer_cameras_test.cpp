// SPDX-License-Identifier: Apache-2.0
// Places of several cameras of a rig: what one of them saw, another recognises.
#include <gtest/gtest.h>

#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_edges.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace loop_closer_cameras_test {

using namespace test_room;

constexpr std::size_t kAhead = 0, kBack = 1;

PlaceMap of_cameras_that_look_ahead(const std::vector<Frame>& frames) {
  LoopCloser closer(rig_that_looks_back(), {}, vocabulary());
  for (const Frame& f : frames) closer.process(f.place, keyframe(FrameId{f.t.ns / 1000}, f.t, f.odometry), kAhead);
  closer.finish();
  return closer.map();
}

/// Where the body is when its camera that looks back is where the one that looks ahead was.
Pose<G, B> turned(const Pose<G, B>& T_GB) {
  const StereoRig quad = rig_that_looks_back();
  return T_GB * quad.T_BC0() * quad.T_BC(2).inverse();
}

TEST(LoopCloserCameras, AFlightThatLooksTheOtherWayIsFoundByTheCameraThatLooksBack) {
  const auto first = flight(room(1), 120, 0, 0, 2), second = flight(room(1), 60, 0, 0, 3, 2.03);
  LoopCloser closer(rig_that_looks_back(), {}, vocabulary(), of_cameras_that_look_ahead(first));
  int loops = 0;
  bool localised = false;
  for (const Frame& f : second) {
    const Pose<G, B> truth = turned(f.truth);
    const MapUpdate u = closer.process(f.place, keyframe(FrameId{f.t.ns / 1000}, f.t, truth), kBack);
    loops += u.stats.accepted;
    localised = u.localised;
    if (!u.localised) continue;
    const Pose<M, B> T_MB = u.T_MG * truth;
    EXPECT_LT((T_MB.p - truth.p).norm(), 0.03);
    EXPECT_LT(angle_between(T_MB.q, truth.q), 0.5 * kDegree);
  }
  EXPECT_TRUE(localised);
  EXPECT_GT(loops, 30);
  closer.finish();
  for (const MapKeyframe& k : closer.map().keyframes()) {
    const Vec3 axis = closer.map().T_MC(k).q * Vec3::UnitZ();
    EXPECT_GT(axis.dot(k.T_MB.q * Vec3::UnitX()) * (k.camera == 0 ? 1 : -1), 0.9) << "ahead, or back";
  }
}

TEST(LoopCloserCameras, APairWhoseLeftCameraDiedGoesOnInTheMap) {
  const auto frames = flight(room(1), 200, 0.004, 0.05, 2);
  const StereoRig pair = rig();
  LoopCloser closer(pair, {}, vocabulary());
  const Pose<B, B> right_for_left = (pair.T_BC0() * pair.T_BC1().cast_frames<B, C0>().inverse());
  int loops = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const bool left = i < 100;  // then the right camera sees, from where the left one was
    const Pose<G, B> T_GB = left ? frames[i].odometry : frames[i].odometry * right_for_left;
    const MapUpdate u =
        closer.process(frames[i].place, keyframe(FrameId{frames[i].t.ns / 1000}, frames[i].t, T_GB), left ? 0 : 1);
    if (!left) loops += u.stats.accepted;
  }
  EXPECT_GT(loops, 60);
  EXPECT_EQ(closer.map().cameras.size(), 2u);
}

}  // namespace loop_closer_cameras_test
}  // namespace fbvins
