// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/health_judge.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace health_judge_test {

constexpr int kManyTracks = 50;

Health good() { return {HealthState::good, HealthReason::none}; }
Health degraded(HealthReason reason) { return {HealthState::degraded, reason}; }
Health lost(HealthReason reason) { return {HealthState::lost, reason}; }

TrackedFrame frame_at(double t_s) {
  TrackedFrame f;
  f.t = Time{} + Duration::from_seconds(t_s);
  f.cameras = {true, true};
  f.stats.stereo = kManyTracks;
  f.imu.samples.resize(11);
  f.imu.longest_gap = Duration::from_seconds(0.005);
  return f;
}

/// Starts with a good frame at 0 s; judges and passes each that follows.
class Judged {
 public:
  Judged() {
    judge_.start();
    EXPECT_EQ(next(frame_at(0)), good());
  }
  Health next(const TrackedFrame& frame, int in_view = kManyTracks, int failed_solves = 0, double sigma_m = 0.1) {
    const Health health = judge_.judge(frame, NavState<G>{}, in_view, {.worst_sigma_m = sigma_m, .failed_solves = failed_solves});
    judge_.pass(frame);
    return health;
  }

 private:
  HealthJudge judge_{EstimatorOptions{}};
};

TEST(HealthJudge, NoImageIsNoImagesAndNotNoTracks) {
  Judged judged;
  for (double t_s = 0.05; t_s < 3; t_s += 0.05) {
    TrackedFrame blind = frame_at(t_s);
    blind.cameras = {};
    blind.stats.stereo = 0;
    EXPECT_EQ(judged.next(blind, 0), degraded(HealthReason::no_images)) << t_s;
  }
  TrackedFrame too_late = frame_at(3.05);
  too_late.cameras = {};
  EXPECT_EQ(judged.next(too_late, 0, 0, 0.5), degraded(HealthReason::no_images)) << "0.49 m added";
  EXPECT_EQ(judged.next(too_late, 0, 0, 0.52), lost(HealthReason::no_images)) << "0.51 m";
}

TEST(HealthJudge, ImagesWithoutTracksAreNoTracks) {
  Judged judged;
  for (double t_s = 0.05; t_s < 3; t_s += 0.05)
    EXPECT_EQ(judged.next(frame_at(t_s), 0), degraded(HealthReason::no_tracks)) << t_s;
  EXPECT_EQ(judged.next(frame_at(3.05), 0, 0, 0.52), lost(HealthReason::no_tracks));
}

TEST(HealthJudge, TheFirstImageAfterAGapIsNoImages) {
  Judged judged;
  for (double t_s : {0.05, 0.10, 0.15, 0.39}) EXPECT_EQ(judged.next(frame_at(t_s)), good());
  EXPECT_EQ(judged.next(frame_at(0.65)), degraded(HealthReason::no_images)) << "a quarter of a second without a stamp";
  EXPECT_EQ(judged.next(frame_at(0.70)), good());
  for (double t_s : {0.75, 0.85, 0.95}) {
    TrackedFrame blind = frame_at(t_s);
    blind.cameras = {};
    EXPECT_EQ(judged.next(blind, 0), degraded(HealthReason::no_images));
  }
  EXPECT_EQ(judged.next(frame_at(1.00)), degraded(HealthReason::no_images)) << "or of stamps without an image";
  EXPECT_EQ(judged.next(frame_at(1.05)), good());
  EXPECT_EQ(judged.next(frame_at(4.15), 0, 0, 0.6), lost(HealthReason::no_images)) << "a gap longer than can be bridged";
}

TEST(HealthJudge, ASlowCameraHasNoGaps) {
  Judged judged;
  for (int k = 1; k < 4; ++k) (void)judged.next(frame_at(0.4 * k));
  for (int k = 4; k < 10; ++k) EXPECT_EQ(judged.next(frame_at(0.4 * k)), good()) << k;
  EXPECT_EQ(judged.next(frame_at(5)), degraded(HealthReason::no_images)) << "1.4 s without a stamp";
}

TEST(HealthJudge, OneImageIsOneCamera) {
  for (const bool left : {true, false}) {
    Judged judged;
    TrackedFrame one = frame_at(0.05);
    one.set_has(left ? 1 : 0, false);
    one.stats.stereo = 0;
    const std::uint8_t missing = left ? 0b10 : 0b01;
    EXPECT_EQ(judged.next(one, left ? kManyTracks : 0), (Health{HealthState::degraded, HealthReason::one_camera, missing}));
  }
  Judged judged;
  TrackedFrame blocked = frame_at(0.05);  // both came, and nothing matches
  blocked.stats.stereo = 0;
  EXPECT_EQ(judged.next(blocked), degraded(HealthReason::one_camera));
}

TEST(HealthJudge, ASilentImuTakesPrecedenceOverMissingImages) {
  Judged judged;
  TrackedFrame silent = frame_at(0.05);
  silent.imu = {};
  EXPECT_EQ(judged.next(silent), degraded(HealthReason::imu_gap));
  silent.cameras = {};
  EXPECT_EQ(judged.next(silent, 0), lost(HealthReason::imu_gap)) << "nothing carries the pose";
}

TEST(HealthJudge, SolverThatFailsThriceIsLost) {
  Judged judged;
  EXPECT_EQ(judged.next(frame_at(0.05), kManyTracks, 2), degraded(HealthReason::solver_failed));
  EXPECT_EQ(judged.next(frame_at(0.10), kManyTracks, 3), lost(HealthReason::solver_failed));
}

TEST(HealthJudge, ImplausibleStatesAreLost) {
  HealthJudge judge{EstimatorOptions{}};
  judge.start();
  NavState<G> fast, biased;
  fast.v_FB = Vec3(31, 0, 0);
  biased.bias.gyro_radps = Vec3(0.6, 0, 0);
  EXPECT_EQ(judge.judge(frame_at(0), fast, kManyTracks, {}), lost(HealthReason::implausible_speed));
  EXPECT_EQ(judge.judge(frame_at(0), biased, kManyTracks, {}), lost(HealthReason::implausible_bias));
}

TEST(HealthJudge, BeforeTheStartMissingImagesTakePrecedenceOverOtherReasons) {
  TrackedFrame frame = frame_at(0);
  EXPECT_EQ(HealthJudge(EstimatorOptions{}).before_start(frame, HealthReason::too_few_features),
            (Health{HealthState::initialising, HealthReason::too_few_features}));
  frame.cameras = {};
  EXPECT_EQ(HealthJudge(EstimatorOptions{}).before_start(frame, HealthReason::too_few_features),
            (Health{HealthState::initialising, HealthReason::no_images}));
}

TEST(HealthJudge, WhatSpeaksAgainstAPoseIsSaidWithItsReason) {
  const auto judged = [](const HealthJudge::Evidence& evidence) {
    HealthJudge judge{EstimatorOptions{}};
    judge.start();
    return judge.judge(frame_at(0), NavState<G>{}, kManyTracks, evidence);
  };
  EXPECT_EQ(judged({}), good());
  EXPECT_EQ(judged({.contradiction = true}), degraded(HealthReason::contradiction));
  EXPECT_EQ(judged({.contradiction = true, .unrecoverable = true}), lost(HealthReason::contradiction));
  EXPECT_EQ(judged({.contradiction = true, .wrong_cameras = 0b01}),
            (Health{HealthState::degraded, HealthReason::cameras_disagree, 0b01}));
  EXPECT_EQ(judged({.after_gap = true}), degraded(HealthReason::imu_gap));
  EXPECT_EQ(judged({.contradiction = true, .clipped = true}), degraded(HealthReason::imu_clipped))
      << "the cause before its effect";
  EXPECT_EQ(judged({.after_dark = true}), degraded(HealthReason::few_tracks));
  EXPECT_EQ(judged({.gyro_vibration_radps = 0.07}), good()) << "an ordinary airframe";
  EXPECT_EQ(judged({.gyro_vibration_radps = 0.35}), degraded(HealthReason::imu_vibration));
}

TEST(HealthJudge, EachReasonInFlightIsReachedAndLeft) {
  struct Case {
    HealthReason reason;
    int in_view;
    HealthJudge::Evidence evidence;
    void (*alter)(TrackedFrame&);
  };
  const auto as_it_is = [](TrackedFrame&) {};
  const Case cases[] = {
      {HealthReason::few_tracks, 9, {}, as_it_is},
      {HealthReason::few_tracks, kManyTracks, {.after_dark = true}, as_it_is},
      {HealthReason::no_tracks, 0, {}, as_it_is},
      {HealthReason::no_images, 0, {}, [](TrackedFrame& f) { f.cameras = {}; }},
      {HealthReason::imu_gap, kManyTracks, {}, [](TrackedFrame& f) { f.imu = {}; }},
      {HealthReason::imu_gap, kManyTracks, {}, [](TrackedFrame& f) { f.imu.longest_gap = Duration::from_seconds(0.06); }},
      {HealthReason::imu_gap, kManyTracks, {.after_gap = true}, as_it_is},
      {HealthReason::one_camera, kManyTracks, {}, [](TrackedFrame& f) { f.set_has(1, false); }},
      {HealthReason::frontend_fault, kManyTracks, {.broken_features = 1}, as_it_is},
      {HealthReason::solver_failed, kManyTracks, {.failed_solves = 1}, as_it_is},
      {HealthReason::contradiction, kManyTracks, {.contradiction = true}, as_it_is},
      {HealthReason::cameras_disagree, kManyTracks, {.wrong_cameras = 0b10}, as_it_is},
      {HealthReason::imu_clipped, kManyTracks, {.clipped = true}, as_it_is},
      {HealthReason::imu_vibration, kManyTracks, {.gyro_vibration_radps = 0.35}, as_it_is},
  };
  for (const Case& c : cases) {
    HealthJudge judge{EstimatorOptions{}};
    judge.start();
    for (int k = 0; k < 30; ++k) {
      const bool wrong = k >= 10 && k < 15;
      TrackedFrame frame = frame_at(0.05 * k);
      if (wrong) c.alter(frame);
      const Health health =
          wrong ? judge.judge(frame, NavState<G>{}, c.in_view, c.evidence) : judge.judge(frame, NavState<G>{}, kManyTracks, {});
      judge.pass(frame);
      if (k == 15) continue;  // the first image after a gap is told as one
      EXPECT_EQ(health.state, wrong ? HealthState::degraded : HealthState::good) << to_string(c.reason) << " " << k;
      EXPECT_EQ(health.reason, wrong ? c.reason : HealthReason::none) << k;
      const bool of_cameras = health.reason == HealthReason::one_camera || health.reason == HealthReason::cameras_disagree;
      EXPECT_EQ(health.without_cameras, of_cameras ? 0b10 : 0) << to_string(c.reason) << " " << k;
    }
  }
}

}  // namespace health_judge_test
}  // namespace fbvins
