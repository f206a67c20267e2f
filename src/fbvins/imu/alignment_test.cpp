// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/alignment.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/imu_test_motion.hpp"

namespace fbvins {
namespace alignment_test {

using test::Motion;
const ImuBias kBias{Vec3(0.02, -0.03, 0.08), Vec3(0.05, -0.06, 0.04)};
const Quat kR_VW = so3_exp(Vec3(1.0, -0.7, 0.4));  // the visual world's arbitrary orientation
const Vec3 kOrigin(3, -2, 1);

struct Window {
  std::vector<Pose<VisualWorld, B>> poses;
  std::vector<Preintegration> between;
  std::vector<NavState<W>> truth;
};

struct Noises {
  bool imu = false;
  double pose_m = 0, pose_rad = 0;
};

Window make_window(const Motion& motion, double begin_s, int frames, const Noises& noises, std::uint64_t seed,
                   double frame_s = 0.05) {
  Window w;
  Rng rng(seed);
  for (int k = 0; k < frames; ++k) {
    const double t = begin_s + frame_s * k;
    const NavState<W> truth = motion.state(t, kBias);
    w.truth.push_back(truth);
    w.poses.push_back({(kR_VW * truth.T_FB.q * so3_exp(noises.pose_rad * test::normal3(rng))).normalized(),
                       Vec3(kR_VW * truth.T_FB.p + kOrigin + noises.pose_m * test::normal3(rng))});
    if (k == 0) continue;
    ImuSegment segment = motion.segment(Time{} + Duration::from_seconds(t - frame_s), Time{} + Duration::from_seconds(t),
                                        Duration{5'000'000}, kBias);
    if (noises.imu) test::add_noise(segment, {}, rng);
    w.between.emplace_back(ImuNoise{}, ImuBias{});
    w.between.back().integrate(segment);
  }
  return w;
}

double gravity_error(const NavState<G>& estimate, const NavState<W>& truth) {
  const Vec3 a = estimate.T_FB.q.conjugate() * Vec3::UnitZ(), b = truth.T_FB.q.conjugate() * Vec3::UnitZ();
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Velocity in B: free of heading.
double velocity_error(const NavState<G>& estimate, const NavState<W>& truth) {
  return (estimate.T_FB.q.conjugate() * estimate.v_FB - truth.T_FB.q.conjugate() * truth.v_FB).norm();
}

TEST(Alignment, IsNearlyExactWithoutNoise) {
  AlignmentOptions options;
  options.accel_bias_prior_mps2 = 10;  // no pull towards zero
  Window w = make_window(Motion(), 0, 31, {}, 1);
  const AlignmentResult a = align_visual_inertial(w.poses, w.between, options);
  ASSERT_TRUE(a.accepted) << to_string(a.reason);
  EXPECT_LT((a.bias.gyro_radps - kBias.gyro_radps).norm(), 2e-4);
  EXPECT_LT((a.bias.accel_mps2 - kBias.accel_mps2).norm(), 1e-2);
  EXPECT_LT(gravity_error(a.states.back(), w.truth.back()), 1e-3);
  EXPECT_LT(velocity_error(a.states.back(), w.truth.back()), 1e-3);
  EXPECT_NEAR(a.gravity_norm_mps2, kGravity_mps2, 0.02);
}

TEST(Alignment, HoldsWithNoisyReadingsAndNoisyPoses) {
  double worst_gravity = 0, worst_velocity = 0, worst_gyro = 0;
  int accepted = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Window w = make_window(Motion(), 0.37 * static_cast<double>(seed), 14, {true, 2e-3, 1.745e-3}, seed);
    const AlignmentResult a = align_visual_inertial(w.poses, w.between);
    if (!a.accepted) continue;
    ++accepted;
    worst_gravity = std::max(worst_gravity, gravity_error(a.states.back(), w.truth.back()));
    worst_velocity = std::max(worst_velocity, velocity_error(a.states.back(), w.truth.back()));
    worst_gyro = std::max(worst_gyro, (a.bias.gyro_radps - kBias.gyro_radps).norm());
  }
  EXPECT_GE(accepted, 19);
  EXPECT_LT(worst_gravity, 0.035);  // 2 degrees
  EXPECT_LT(worst_velocity, 0.08);
  EXPECT_LT(worst_gyro, 0.012);
}

// Errors of gyro bias and gravity against the standard deviations claimed, biases drawn near the prior.
TEST(Alignment, ItsStandardDeviationsAreConsistent) {
  double gyro = 0, gravity = 0;
  int n = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Window w = make_window(Motion(), 0.21 * static_cast<double>(seed), 14, {true, 2e-3, 1.5e-3}, 100 + seed);
    const AlignmentResult a = align_visual_inertial(w.poses, w.between);
    if (!a.accepted) continue;
    ++n;
    gyro += (a.bias.gyro_radps - kBias.gyro_radps).squaredNorm() / 3 / std::pow(a.gyro_bias_sigma_radps, 2);
    gravity += std::pow(gravity_error(a.states.back(), w.truth.back()), 2) / 2 / std::pow(a.gravity_sigma_rad, 2);
  }
  ASSERT_GT(n, 50);
  EXPECT_LT(gyro / n, 1.5);
  EXPECT_GT(gyro / n, 0.3);
  EXPECT_LT(gravity / n, 1.5);  // below 1: the bias here is smaller than its prior, and the sigma is of the worst axis
}

TEST(Alignment, WorldIsLevelWithItsOriginAtTheFirstBody) {
  Window w = make_window(Motion(), 0, 20, {}, 1);
  const AlignmentResult a = align_visual_inertial(w.poses, w.between);
  ASSERT_TRUE(a.accepted);
  ASSERT_EQ(a.states.size(), w.poses.size());
  EXPECT_EQ(a.states[0].T_FB.p.norm(), 0);
  EXPECT_NEAR(so3_log(a.states[0].T_FB.q).z(), 0, 1e-12);  // no rotation about gravity
  const Quat relative = a.states[0].T_FB.q.conjugate() * a.states[5].T_FB.q;
  EXPECT_LT(so3_log(relative.conjugate() * (w.poses[0].q.conjugate() * w.poses[5].q)).norm(), 1e-12);
}

TEST(Alignment, RepropagatesTheIntervalsAtTheBiasFound) {
  Window w = make_window(Motion(), 0, 20, {}, 1);
  const AlignmentResult a = align_visual_inertial(w.poses, w.between);
  ASSERT_TRUE(a.accepted);
  for (const Preintegration& p : w.between) {
    EXPECT_EQ(p.linearisation_bias().gyro_radps, a.bias.gyro_radps);
    EXPECT_EQ(p.linearisation_bias().accel_mps2, a.bias.accel_mps2);
  }
}

TEST(Alignment, DoesNotDependOnTheBiasTheIntervalsCameWith) {
  Window w = make_window(Motion(), 0, 20, {}, 1), other = w;
  for (Preintegration& p : other.between) p.repropagate({Vec3(0.05, 0, 0), Vec3(0.2, -0.3, 0.1)});
  const AlignmentResult a = align_visual_inertial(w.poses, w.between), b = align_visual_inertial(other.poses, other.between);
  ASSERT_TRUE(a.accepted && b.accepted);
  EXPECT_LT((a.bias.accel_mps2 - b.bias.accel_mps2).norm(), 1e-6);
  EXPECT_LT(so3_log(a.R_GV.conjugate() * b.R_GV).norm(), 1e-6);
}

TEST(Alignment, AcceptsRestAndReportsTheAccelerometerBiasAsUnobserved) {
  Window w = make_window(Motion(0, 0), 0, 14, {true, 5e-4, 3e-4}, 4);
  AlignmentOptions options;
  const AlignmentResult a = align_visual_inertial(w.poses, w.between, options);
  ASSERT_TRUE(a.accepted) << to_string(a.reason);
  EXPECT_LT(gravity_error(a.states.back(), w.truth.back()), 0.02);
  EXPECT_LT(a.states.back().v_FB.norm(), 0.01);
  EXPECT_GT(a.accel_bias_sigma_mps2, 0.5 * options.accel_bias_prior_mps2);
}

TEST(Alignment, ABiasKnownFromBeforeMakesTheStartLevel) {
  Window unknown = make_window(Motion(), 1.0, 14, {}, 5), known = unknown;
  const AlignmentResult without = align_visual_inertial(unknown.poses, unknown.between);
  AlignmentOptions options;
  options.accel_bias_mps2 = kBias.accel_mps2;
  options.accel_bias_prior_mps2 = 0.02;
  const AlignmentResult with = align_visual_inertial(known.poses, known.between, options);
  ASSERT_TRUE(without.accepted && with.accepted);
  EXPECT_LT(gravity_error(with.states[0], known.truth[0]), 1e-4);
  EXPECT_LT(with.gravity_sigma_rad, 0.5 * without.gravity_sigma_rad);
}

TEST(Alignment, RefusesWithTheRightReason) {
  const auto reason = [](Window w, const AlignmentOptions& o = {}) {
    return align_visual_inertial(w.poses, w.between, o).reason;
  };
  const Window good = make_window(Motion(), 0, 14, {true, 1e-3, 1e-3}, 2);
  EXPECT_EQ(reason(good), AlignmentRefusal::none);

  Window few = good;
  few.poses.resize(2);
  EXPECT_EQ(reason(few), AlignmentRefusal::too_few_frames);
  EXPECT_EQ(reason(make_window(Motion(), 0, 5, {}, 1)), AlignmentRefusal::too_short);

  Window mismatch = good;
  mismatch.between.pop_back();
  EXPECT_EQ(reason(mismatch), AlignmentRefusal::bad_input);
  Window nan = good;
  nan.poses[3].p.x() = std::nan("");
  EXPECT_EQ(reason(nan), AlignmentRefusal::bad_input);

  Window scaled = good;  // visual scale three times too large
  for (auto& T : scaled.poses) T.p *= 3;
  EXPECT_NE(reason(scaled), AlignmentRefusal::none);

  Window shuffled = good;  // images and readings do not belong together
  std::reverse(shuffled.poses.begin(), shuffled.poses.end());
  EXPECT_NE(reason(shuffled), AlignmentRefusal::none);

  Window bent = good;
  bent.poses[7].q = bent.poses[7].q * so3_exp(Vec3(0, 0.2, 0));
  EXPECT_EQ(reason(bent), AlignmentRefusal::rotation_inconsistent);
}

TEST(Alignment, RefusesWhatCoarsePosesCannotObserve) {
  AlignmentOptions coarse;
  coarse.pose_sigma_m = 0.3;
  Window w = make_window(Motion(), 0, 10, {true, 2e-3, 1e-3}, 2);
  EXPECT_EQ(align_visual_inertial(w.poses, w.between, coarse).reason, AlignmentRefusal::gravity_unobservable);
  coarse = {};
  coarse.pose_sigma_rad = 0.1;
  w = make_window(Motion(), 0, 10, {true, 2e-3, 1e-3}, 2);
  EXPECT_EQ(align_visual_inertial(w.poses, w.between, coarse).reason, AlignmentRefusal::gyro_bias_unobservable);
}

}  // namespace alignment_test
}  // namespace fbvins
