// SPDX-License-Identifier: Apache-2.0
// Frames and landmarks of the window, for a body that moves sideways and observes points without noise.
#include "fbvins/estimator/sliding_window.hpp"

#include <gtest/gtest.h>

#include <map>

#include "fbvins/estimator/window_views.hpp"

namespace fbvins {
namespace sliding_window_test {

constexpr double kBaseline_m = 0.1, kStep_m = 0.1;

/// Body and left camera are one; frame k is at x = k * kStep_m and looks along z.
Calibration rig() {
  Calibration c;
  c.cameras[1].p = Vec3(kBaseline_m, 0, 0);
  return c;
}
NavState<G> state_at(int k) {
  NavState<G> s;
  s.T_FB.p = Vec3(kStep_m * k, 0, 0);
  return s;
}
Time stamp(int k) { return Time{k * 50'000'000}; }

Observation seen_at(const Vec3& p_C) {
  Observation o;
  o.normalised = p_C.head<2>() / p_C.z();
  o.pixel = 400 * o.normalised + Vec2(376, 240);
  o.sqrt_information = 800 * Mat2::Identity();
  return o;
}

/// Readings at rest from the frame before.
ImuSegment readings_up_to(int k) {
  ImuSegment out;
  for (int i = 0; i <= 10; ++i) out.samples.push_back({stamp(k - 1) + Duration{i * 5'000'000}, Vec3::Zero(), Vec3(0, 0, 9.81)});
  return out;
}

struct Scene {
  std::map<int, Vec3> points_G;  ///< by track
  Calibration calibration = rig();
  SlidingWindow window;
  WindowProblem problem;

  explicit Scene(const EstimatorOptions& options = {}) : window(options, WindowWeights{}) {
    for (int track = 0; track < 12; ++track) points_G[track] = Vec3(0.2 * track - 1, 0.1 * (track % 4), 2 + 0.1 * track);
  }

  TrackedFeature feature(int track, int k, bool stereo = true, const Vec2& left_shift = Vec2::Zero()) const {
    const Vec3 p_B = state_at(k).T_FB.inverse() * points_G.at(track);
    TrackedFeature f;
    f.id = TrackId{track};
    f.see(0, seen_at(p_B));
    f.by(0)->normalised += left_shift;
    if (stereo) f.see(1, seen_at(calibration.T_BC1().inverse() * p_B));
    return f;
  }
  std::vector<TrackedFeature> all(int k, bool stereo = true) const {
    std::vector<TrackedFeature> out;
    for (const auto& [track, p] : points_G) out.push_back(feature(track, k, stereo));
    return out;
  }
  void add(int k, const std::vector<TrackedFeature>& features, bool keyframe = false) {
    Frame f;
    f.id = FrameId{k};
    f.t = stamp(k);
    f.state = state_at(k);
    f.keyframe = keyframe;
    if (k > 0) {
      Preintegration imu(ImuNoise{}, ImuBias{});
      imu.integrate(readings_up_to(k));
      f.imu = std::make_shared<const Preintegration>(std::move(imu));
    }
    window.add_frame(std::move(f), features, calibration);
  }
  const Landmark* landmark(int track) const {
    for (const Landmark& l : window.landmarks().all())
      if (l.track == TrackId{track}) return &l;
    return nullptr;
  }
  Vec3 position_G(int track) const {
    const Landmark& l = *landmark(track);
    const Pose<G, C0> T_GC = window.frames().at(l.host).state.T_FB * calibration.T_BC0();
    return T_GC * Vec3(Vec3(l.alpha_beta_rho.x(), l.alpha_beta_rho.y(), 1) / l.alpha_beta_rho.z());
  }
  const WindowProblem& fill_problem() {
    window.fill_problem(calibration, problem);
    return problem;
  }
  /// A tight prior on the first frame, as the estimator has one.
  void hold_first() {
    WindowPrior prior;
    prior.frames = {0};
    prior.with_tilt = true;
    prior.quadratic.H = 1e6 * Eigen::MatrixXd::Identity(17, 17);
    prior.quadratic.g = Eigen::VectorXd::Zero(17);
    window.set_prior(std::move(prior));
  }
};

TEST(SlidingWindow, FilesObservationsUnderTheirTracks) {
  Scene s;
  s.add(0, s.all(0));
  s.add(1, {s.feature(3, 1), s.feature(4, 1, false)});
  EXPECT_EQ(s.window.frames().size(), 2);
  ASSERT_EQ(s.window.landmarks().all().size(), s.points_G.size());
  EXPECT_EQ(s.landmark(3)->frame_count(), 2);
  EXPECT_EQ(s.landmark(3)->seen_by_cameras(FrameId{1}).size(), 2u);
  EXPECT_EQ(s.landmark(4)->seen_by_cameras(FrameId{1}).size(), 1u);
  EXPECT_EQ(s.landmark(5)->frame_count(), 1);
  EXPECT_EQ(s.landmark(5)->host, FrameId{0});
  // 0.1 m in 50 ms, 2.3 m away: the velocity of both observations is that of their difference.
  const std::span<const Sighting> before = s.landmark(3)->seen_by_cameras(FrameId{0}), now = s.landmark(3)->newest();
  EXPECT_NEAR(before[0].velocity.x(), -kStep_m / 0.05 / 2.3, 1e-9);
  EXPECT_EQ(before[0].velocity, now[0].velocity);
  EXPECT_EQ(landmarks_in_view(s.window), 2);
}

TEST(SlidingWindow, TriangulatesWhereTwoRaysAgreeAndFarEnoughApart) {
  Scene s;
  s.add(0, {s.feature(0, 0), s.feature(1, 0, false), s.feature(2, 0)});
  EXPECT_TRUE(s.landmark(0)->triangulated) << "two cameras";
  EXPECT_LT((s.position_G(0) - s.points_G[0]).norm(), 1e-9);
  EXPECT_FALSE(s.landmark(1)->triangulated) << "one ray";
  s.add(1, {s.feature(1, 1, false)});
  EXPECT_TRUE(s.landmark(1)->triangulated) << "two frames";
  EXPECT_LT((s.position_G(1) - s.points_G[1]).norm(), 1e-9);
}

TEST(SlidingWindow, DoesNotTriangulateRaysThatDoNotMeet) {
  Scene s;
  s.points_G[20] = Vec3(0.02, 0.01, 0.05);  // nearer than any landmark may be
  s.points_G[21] = Vec3(3, 1, 4000);
  s.add(0, {s.feature(6, 0, true, Vec2(0, 0.02)), s.feature(7, 0, true, Vec2(-0.2, 0)), s.feature(20, 0), s.feature(21, 0)});
  EXPECT_FALSE(s.landmark(6)->triangulated) << "rays pass one another by sixteen sigmas";
  EXPECT_FALSE(s.landmark(7)->triangulated) << "they meet behind the cameras";
  EXPECT_FALSE(s.landmark(20)->triangulated);
  ASSERT_TRUE(s.landmark(21)->triangulated);
  EXPECT_NEAR(s.landmark(21)->alpha_beta_rho.z(), 1 / kFarthestLandmark_m, 1e-12) << "kept at the limit";
}

TEST(SlidingWindow, DescribesWhichLandmarkIsWhich) {
  Scene s;
  for (int k = 0; k < 3; ++k) s.add(k, s.all(k, k != 1));
  s.add(3, {s.feature(5, 3)});
  const WindowProblem& p = s.fill_problem();
  ASSERT_EQ(p.frames.size(), 4u);
  EXPECT_EQ(p.frames[2].id, FrameId{2});
  EXPECT_EQ(p.index_of(FrameId{2}), 2);
  ASSERT_EQ(p.landmarks.size(), s.points_G.size());
  std::vector<Vec2> residuals;
  for (const WindowLandmark& l : p.landmarks) {
    const Landmark* filed = s.window.landmarks().find(l.id);
    ASSERT_NE(filed, nullptr);
    EXPECT_EQ(l.alpha_beta_rho, filed->alpha_beta_rho);
    EXPECT_EQ(l.observation_count, filed->track == TrackId{5} ? 7 : 5) << "both cameras, the left alone in frame 1";
    p.residuals(CameraGeometry(p.calibration), l, residuals);
    for (const Vec2& r : residuals) EXPECT_LT(r.norm(), 1e-6);
  }
}

TEST(SlidingWindow, DescribesTheLandmarksSeenMostWhenThereAreTooMany) {
  EstimatorOptions options;
  options.max_landmarks = 5;
  Scene s(options);
  for (int k = 0; k < 2; ++k) s.add(k, s.all(k));
  s.add(2, {s.feature(1, 2), s.feature(8, 2), s.feature(10, 2)});
  std::vector<TrackId> tracks;
  for (const WindowLandmark& l : s.fill_problem().landmarks) tracks.push_back(s.window.landmarks().find(l.id)->track);
  EXPECT_EQ(tracks, (std::vector<TrackId>{{0}, {1}, {2}, {8}, {10}})) << "then those filed first";
}

TEST(SlidingWindow, AcceptsASolutionByIdsThoughFramesHaveLeftMeanwhile) {
  Scene s;
  for (int k = 0; k < 4; ++k) s.add(k, s.all(k));
  WindowProblem solved = s.fill_problem();
  for (WindowFrame& f : solved.frames) f.state.v_FB = Vec3(static_cast<double>(f.id.value), 0, 0);
  for (WindowLandmark& l : solved.landmarks) l.alpha_beta_rho.z() += 1e-3 * static_cast<double>(l.id.value);
  s.window.drop_frame(1, s.calibration);
  const double before = s.landmark(7)->alpha_beta_rho.z();
  s.window.take_estimates(solved);
  EXPECT_EQ(s.window.frames().size(), 3);
  for (const Frame& f : s.window.frames()) EXPECT_EQ(f.state.v_FB.x(), static_cast<double>(f.id.value));
  EXPECT_NEAR(s.landmark(7)->alpha_beta_rho.z() - before, 1e-3 * static_cast<double>(s.landmark(7)->id.value), 1e-12);
}

TEST(SlidingWindow, AFrameThatIsDroppedLeavesItsReadingsToTheNext) {
  Scene s;
  for (int k = 0; k < 4; ++k) s.add(k, k == 0 ? std::vector<TrackedFeature>{} : s.all(k));
  EXPECT_EQ(s.landmark(2)->host, FrameId{1});
  s.window.drop_frame(1, s.calibration);
  EXPECT_EQ(s.window.frames().index_of(FrameId{1}), -1);
  const Frame& next = s.window.frames()[1];
  EXPECT_EQ(next.id, FrameId{2});
  EXPECT_EQ(next.imu->begin(), stamp(0));
  EXPECT_EQ(next.imu->end(), stamp(2));
  EXPECT_EQ(next.imu->size(), 21);
  // Landmarks it hosted are hosted by the next frame that sees them, and stay where they are.
  EXPECT_EQ(s.landmark(2)->host, FrameId{2});
  EXPECT_EQ(s.landmark(2)->frame_count(), 2);
  EXPECT_LT((s.position_G(2) - s.points_G[2]).norm(), 1e-9);
}

TEST(SlidingWindow, AFrameInThePriorIsDroppedIntoIt) {
  Scene s;
  for (int k = 0; k < 4; ++k) s.add(k, s.all(k));
  s.hold_first();
  s.window.drop_frame(0, s.calibration);
  EXPECT_EQ(s.window.frames().oldest().id, FrameId{1});
  EXPECT_EQ(s.window.frames().oldest().imu, nullptr) << "its readings are in the prior";
  const WindowPrior& prior = s.window.prior();
  EXPECT_EQ(prior.frames, std::vector<int>{0});
  ASSERT_EQ(prior.quadratic.size(), 17);
  const Eigen::MatrixXd covariance = prior.quadratic.H.inverse();
  const Eigen::VectorXd step = -covariance * prior.quadratic.g;
  // By its readings at rest frame 1 would be where frame 0 is.
  EXPECT_LT((step - -kStep_m * Eigen::VectorXd::Unit(17, 2)).norm(), 1e-9) << step.transpose();
  const ImuNoise noise;
  const double dt = (stamp(1) - stamp(0)).seconds(), held = 1e-6;
  const auto squared = [](double x) { return x * x; };
  EXPECT_NEAR(covariance(0, 0), held, 1e-12) << "the tilt stays known as well as it was";
  EXPECT_NEAR(covariance(2, 2), held * (1 + dt * dt), 1e-9) << "the position by the velocity";
  EXPECT_NEAR(covariance(10, 10), held * (1 + dt * dt) + squared(noise.accel_noise_density_mps2_rthz) * dt, 1e-9)
      << "the upward velocity by the bias and the noise";
  EXPECT_NEAR(covariance(16, 16), held + squared(noise.accel_random_walk_mps3_rthz) * dt, 1e-9) << "the bias has walked";
  EXPECT_TRUE(s.window.frames().oldest().in_prior);
  EXPECT_EQ(s.window.landmarks().all().size(), s.points_G.size());
}

TEST(SlidingWindow, OutliersAreRemovedAndThreeSolvesWithOutliersRejectATrack) {
  Scene s;
  for (int k = 0; k < 3; ++k) s.add(k, s.all(k));
  for (int round = 1; round <= 3; ++round) {
    const int k = 2 + round;
    std::vector<TrackedFeature> features = s.all(k);
    features[4] = s.feature(4, k, true, Vec2(0, 0.05));  // forty sigmas
    s.add(k, features);
    EXPECT_EQ(s.window.remove_outliers(s.fill_problem()), 1) << round;
    if (round == 3) break;
    EXPECT_EQ(s.landmark(4)->outlier_count, round);
    EXPECT_EQ(s.landmark(4)->frame_count(), 3) << "the good ones stay";
  }
  EXPECT_EQ(s.landmark(4), nullptr);
  EXPECT_TRUE(s.window.landmarks().rejected(TrackId{4}));
  s.add(6, s.all(6));
  EXPECT_EQ(s.landmark(4), nullptr) << "the track is not followed any more";
  s.window.clear();
  s.add(7, s.all(7));
  EXPECT_NE(s.landmark(4), nullptr) << "in a new window it is";
}

TEST(SlidingWindow, ARightOutlierLeavesTheLeftObservation) {
  Scene s;
  for (int k = 0; k < 2; ++k) s.add(k, s.all(k));
  std::vector<TrackedFeature> features = s.all(2);
  features[4].by(1)->normalised.y() += 0.05;
  s.add(2, features);
  EXPECT_EQ(s.window.remove_outliers(s.fill_problem()), 1);
  EXPECT_EQ(s.landmark(4)->frame_count(), 3);
  ASSERT_EQ(s.landmark(4)->newest().size(), 1u);
  EXPECT_EQ(s.landmark(4)->newest().front().seen.camera, 0);
}

TEST(SlidingWindow, WhatSeveralCamerasSeeIsAllThere) {
  const auto flown = [](const Vec2& left_shift, double third_shift) {
    Scene s;
    s.calibration.cameras.push_back({Quat::Identity(), Vec3(0, -kBaseline_m, 0)});  // above the left one
    for (int k = 0; k < 3; ++k) {
      std::vector<TrackedFeature> features = s.all(k);
      if (k == 2) features[4] = s.feature(4, k, true, left_shift);
      for (TrackedFeature& f : features) {
        const Vec3 p_B = state_at(k).T_FB.inverse() * s.points_G.at(static_cast<int>(f.id.value));
        f.see(2, seen_at(s.calibration.T_BC(2).inverse() * p_B));
      }
      if (k == 2) features[4].by(2)->normalised.x() += third_shift;
      s.add(k, features);
    }
    EXPECT_EQ(s.fill_problem().observations.size(), 3 * 3 * s.points_G.size());
    EXPECT_LT((s.position_G(4) - s.points_G[4]).norm(), 1e-9);
    s.window.remove_outliers(s.problem);
    return s.landmark(4)->seen_by_cameras(FrameId{2}).size();
  };
  EXPECT_EQ(flown(Vec2::Zero(), 0), 3u);
  EXPECT_EQ(flown(Vec2::Zero(), 0.05), 2u) << "the other two stay";
  EXPECT_EQ(flown(Vec2(0, 0.05), 0), 0u) << "the others were found from the lead";
}

/// Keyframes 0 and 1, then three newest frames; track 0 is seen by the keyframes alone, track 1 by all.
Scene about_to_shrink() {
  Scene s;
  for (int k = 0; k < 2; ++k) s.add(k, s.all(k), true);
  for (int k = 2; k < 5; ++k) s.add(k, {s.feature(1, k), s.feature(2, k), s.feature(3, k)});
  s.hold_first();
  return s;
}

TEST(SlidingWindow, LandmarksLeaveWithTheirKeyframeAndAreRemembered) {
  Scene s = about_to_shrink();
  s.window.marginalise_keyframe(0, s.calibration);
  EXPECT_EQ(s.window.frames().oldest().id, FrameId{1});
  EXPECT_EQ(s.window.frames().oldest().imu, nullptr);
  EXPECT_EQ(s.landmark(0), nullptr) << "out of view";
  ASSERT_NE(s.landmark(1), nullptr) << "in view: starts anew from the newest frames";
  EXPECT_EQ(s.landmark(1)->host, FrameId{2});
  EXPECT_EQ(s.landmark(1)->frame_count(), 3);
  ASSERT_TRUE(s.landmark(1)->prior.has_value());
  EXPECT_LT((s.landmark(1)->prior->p_G - s.points_G[1]).norm(), 1e-6);
  const auto known = s.window.known().find(TrackId{0});
  ASSERT_TRUE(known.has_value());
  EXPECT_LT((known->p_G - s.points_G[0]).norm(), 1e-6);
  EXPECT_EQ(s.window.known().take_new().size(), s.points_G.size());

  s.add(5, {s.feature(0, 5)});  // seen again under its old track
  ASSERT_TRUE(s.landmark(0)->prior.has_value());
  s.add(6, {s.feature(0, 6)});
  EXPECT_EQ(s.window.refuse_landmark_priors(s.fill_problem()), 0);
}

TEST(SlidingWindow, ALandmarkFarFromItsPriorIsAnother) {
  Scene s = about_to_shrink();
  s.window.marginalise_keyframe(0, s.calibration);
  s.points_G[0] += Vec3(0, 0.8, 0);  // far from the estimate: its triangulation refuses the prior
  s.add(5, {s.feature(0, 5), s.feature(1, 5), s.feature(2, 5)});
  EXPECT_FALSE(s.landmark(0)->prior.has_value());
  EXPECT_FALSE(s.window.known().find(TrackId{0}).has_value());

  WindowProblem solved = s.fill_problem();  // near at first, but moved away by the solve
  ASSERT_FALSE(solved.landmark_priors.empty());
  const int known = solved.landmarks[0].prior >= 0 ? 0 : 1;
  solved.landmarks[known].alpha_beta_rho.y() += 0.1;
  const LandmarkId id = solved.landmarks[known].id;
  EXPECT_EQ(s.window.refuse_landmark_priors(solved), 1);
  EXPECT_FALSE(s.window.landmarks().find(id)->prior.has_value());
}

TEST(SlidingWindow, SnapshotKeyframeAndDistanceShowItsContents) {
  Scene s;
  for (int k = 0; k < 3; ++k) s.add(k, s.all(k), k == 1);
  const WindowSnapshot snapshot = snapshot_of(s.window, s.calibration);
  ASSERT_EQ(snapshot.frames.size(), 3u);
  EXPECT_TRUE(snapshot.frames[1].keyframe);
  EXPECT_EQ(snapshot.frames[2].T_WB.p, state_at(2).T_FB.p);
  ASSERT_EQ(snapshot.landmarks.size(), s.points_G.size());
  for (const WindowSnapshot::Landmark& l : snapshot.landmarks) {
    EXPECT_EQ(l.observations, 3);
    EXPECT_LT((l.p_W - s.points_G[static_cast<int>(l.track.value)]).norm(), 1e-9);
  }
  const Keyframe keyframe = keyframe_of(s.window, 1, s.calibration);
  EXPECT_EQ(keyframe.id, FrameId{1});
  ASSERT_EQ(keyframe.landmarks.size(), s.points_G.size());
  EXPECT_LT((keyframe.landmarks[0].p_B - (s.points_G[0] - state_at(1).T_FB.p)).norm(), 1e-9);
  // No rotation: the image motion since the keyframe is the step divided by the depth.
  const KeyframeDistance d = distance_to_last_keyframe(s.window, s.calibration, 400);
  EXPECT_EQ(d.shared_ratio, 1);
  EXPECT_GT(d.parallax_px, 400 * kStep_m / 3.2);
  EXPECT_LT(d.parallax_px, 400 * kStep_m / 1.9);
  EXPECT_EQ(d.age, Duration{50'000'000});
}

}  // namespace sliding_window_test
}  // namespace fbvins
