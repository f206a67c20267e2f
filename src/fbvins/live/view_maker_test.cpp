// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/view_maker.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace view_maker_test {

TrackedFrame frame_with(Time t, std::initializer_list<std::int64_t> tracks) {
  TrackedFrame frame;
  frame.t = t;
  for (const std::int64_t track : tracks) {
    TrackedFeature feature;
    feature.id = TrackId{track};
    feature.see(0, Observation{.pixel = Vec2(10. * static_cast<double>(track), 5)});
    feature.age_frames = static_cast<int>(track);
    frame.features.push_back(feature);
  }
  return frame;
}

Odometry odometry_at(Time t, const Vec3& p) {
  Odometry o;
  o.t = t;
  o.T_WB.p = p;
  o.health.state = HealthState::good;
  return o;
}

/// The camera looks along x of the body: z of C0 is x of B.
StereoRig looking_ahead() {
  Mat3 R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  StereoRig rig;
  rig.cameras.resize(2);
  rig.cameras[1].camera = Camera(PinholeRadtan{100, 100, 32, 24}, 64, 48);
  rig.cameras[0].T_BC = {Quat(R), Vec3(0.1, 0, 0)};
  rig.cameras.push_back({rig.right(), {Quat(R) * Quat(Eigen::AngleAxisd(M_PI, Vec3::UnitY())), Vec3(-0.2, 0, 0)}});  // backwards
  return rig;
}

TEST(ViewMaker, FeaturesAreThoseOfTheirCamera) {
  ViewMaker views(looking_ahead());
  TrackedFrame frame = frame_with(Time{7}, {1, 2});
  frame.features[1] = {.id = TrackId{2}, .lead = 2};
  frame.features[1].see(2, Observation{});
  views.add(frame);
  WindowSnapshot window;
  window.frames.push_back({FrameId{0}, Time{7}, {}, true});
  window.landmarks = {{LandmarkId{0}, TrackId{1}, Vec3(3.1, 0, 0), 3}, {LandmarkId{1}, TrackId{2}, Vec3(-5.2, 0, 0), 3}};
  views.add(window);
  const LiveView view = views.view_of(odometry_at(Time{7}, Vec3::Zero()), 0);
  ASSERT_EQ(view.features.size(), 2u);
  EXPECT_EQ(view.features[0].camera, 0);
  EXPECT_NEAR(view.features[0].depth_m, 3, 1e-12);
  EXPECT_EQ(view.features[1].camera, 2);
  EXPECT_NEAR(view.features[1].depth_m, 5, 1e-12);
  EXPECT_TRUE(view.right_features.empty());
}

TEST(ViewMaker, WhatTheRightCameraSeesIsThereAsWell) {
  StereoRig rig = looking_ahead();
  rig.cameras[1].T_BC = rig.T_BC0();
  ViewMaker views(rig);
  TrackedFrame frame = frame_with(Time{7}, {1, 2});
  frame.features[0].see(1, Observation{.pixel = Vec2(3, 4)});
  views.add(frame);
  WindowSnapshot window;
  window.frames.push_back({FrameId{0}, Time{7}, {}, true});
  window.landmarks = {{LandmarkId{0}, TrackId{1}, Vec3(3.1, 0, 0), 3}};
  views.add(window);
  const LiveView view = views.view_of(odometry_at(Time{7}, Vec3::Zero()), 0);
  EXPECT_EQ(view.features.size(), 2u);
  ASSERT_EQ(view.right_features.size(), 1u);
  EXPECT_EQ(view.right_features[0].camera, 1);
  EXPECT_EQ(view.right_features[0].pixel, Vec2(3, 4));
  EXPECT_NEAR(view.right_features[0].depth_m, 3, 1e-12);
}

TEST(ViewMaker, GivesFeaturesTheDepthOfTheirLandmarks) {
  ViewMaker views(looking_ahead());
  views.add(frame_with(Time{7}, {1, 2}));
  WindowSnapshot window;
  window.frames.push_back({FrameId{0}, Time{7}, Pose<W, B>{Quat::Identity(), Vec3(1, 0, 0)}, true});
  window.landmarks.push_back({LandmarkId{0}, TrackId{2}, Vec3(5.1, 1, 0), 3});
  views.add(window);
  const LiveView view = views.view_of(odometry_at(Time{7}, Vec3(1, 0, 0)), 12.5);
  ASSERT_EQ(view.features.size(), 2u);
  EXPECT_EQ(view.features[0].depth_m, 0);
  EXPECT_NEAR(view.features[1].depth_m, 4, 1e-12);  // 5.1 less the body's 1 and the camera's 0.1
  EXPECT_EQ(view.features[1].age_frames, 2);
  EXPECT_EQ(view.shutter_to_pose_ms, 12.5);
  ASSERT_EQ(view.keyframes_W.size(), 1u);
}

TEST(ViewMaker, LandmarksAreInThePublishedFrame) {
  ViewMaker views(looking_ahead());
  WindowSnapshot window;
  window.frames.push_back({FrameId{0}, Time{7}, Pose<W, B>{Quat::Identity(), Vec3(1, 0, 0)}, false});
  window.landmarks.push_back({LandmarkId{0}, TrackId{2}, Vec3(5, 1, 0), 3});
  views.add(window);
  const LiveView view = views.view_of(odometry_at(Time{7}, Vec3(1, 0.25, 0)), 0);
  ASSERT_EQ(view.landmarks.size(), 1u);
  EXPECT_NEAR((view.landmarks[0].p_W - Vec3(5, 1.25, 0)).norm(), 0, 1e-12);
}

TEST(ViewMaker, WithoutAPoseThereAreFeaturesAlone) {
  ViewMaker views(looking_ahead());
  views.add(frame_with(Time{7}, {1}));
  WindowSnapshot window;
  window.frames.push_back({FrameId{0}, Time{7}, {}, true});
  window.landmarks.push_back({LandmarkId{0}, TrackId{1}, Vec3(5, 1, 0), 3});
  views.add(window);
  Odometry blind = odometry_at(Time{7}, Vec3::Zero());
  blind.health.state = HealthState::initialising;
  const LiveView view = views.view_of(blind, 0);
  EXPECT_EQ(view.features.size(), 1u);
  EXPECT_TRUE(view.landmarks.empty());
  EXPECT_TRUE(views.view_of(odometry_at(Time{8}, Vec3::Zero()), 0).features.empty());  // of another image
}

}  // namespace view_maker_test
}  // namespace fbvins
