// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/preintegration.hpp"

#include <gtest/gtest.h>

#include "tests/support/integrated_test_motion.hpp"
#include "tests/support/jacobian_check.hpp"

namespace fbvins {
namespace preintegration_test {

using test::integrated;
using test::kBias;
using test::kFrom;
using test::kTo;
using test::Motion;

Vec15 prediction_error(const Motion& motion, Duration period) {
  const Preintegration p = integrated(motion.segment(kFrom, kTo, period, kBias), kBias);
  return p.predict(motion.state(kFrom.seconds(), kBias), level_gravity()).boxminus(motion.state(kTo.seconds(), kBias));
}

TEST(Preintegration, FollowsAnExactMotionWithErrorOfSecondOrder) {
  const Motion motion;
  const Vec15 at_200hz = prediction_error(motion, Duration{5'000'000});
  const Vec15 at_800hz = prediction_error(motion, Duration{1'250'000});
  EXPECT_LT(at_200hz.segment<3>(nav::p).norm(), 5e-5);
  EXPECT_LT(at_200hz.segment<3>(nav::theta).norm(), 3e-5);
  EXPECT_LT(at_200hz.segment<3>(nav::v).norm(), 2e-4);
  for (const int block : {nav::p, nav::theta, nav::v}) {
    const double ratio = at_200hz.segment<3>(block).norm() / at_800hz.segment<3>(block).norm();
    EXPECT_NEAR(ratio, 16, 1.5) << "block at " << block;  // 4^2: second order
  }
}

TEST(Preintegration, IsExactForAConstantRateAndForce) {
  ImuSegment segment;
  for (int k = 0; k <= 20; ++k) segment.samples.push_back({Time{k * 5'000'000}, Vec3(0, 0, 2.0), Vec3(0, 0, 3.0)});
  const Preintegration p = integrated(segment, {});
  EXPECT_NEAR((so3_log(p.delta_q()) - Vec3(0, 0, 0.2)).norm(), 0, 1e-13);
  EXPECT_NEAR((p.delta_v() - Vec3(0, 0, 0.3)).norm(), 0, 1e-13);
  EXPECT_NEAR((p.delta_p() - Vec3(0, 0, 0.015)).norm(), 0, 1e-13);
}

TEST(Preintegration, BiasJacobiansMatchNumericOnes) {
  const ImuSegment segment = Motion().segment(kFrom, kTo, Duration{5'000'000}, kBias);
  const Preintegration p = integrated(segment, kBias);
  const auto deltas = [&](const Eigen::VectorXd& d) {
    const Preintegration moved = integrated(segment, {kBias.gyro_radps + d.head<3>(), kBias.accel_mps2 + d.tail<3>()});
    Eigen::VectorXd r(9);
    r << moved.delta_p(), so3_log(p.delta_q().conjugate() * moved.delta_q()), moved.delta_v();
    return r;
  };
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(9, 6);
  J << p.J_p_bg(), p.J_p_ba(), p.J_theta_bg(), Mat3::Zero(), p.J_v_bg(), p.J_v_ba();
  const auto check = check_jacobian(deltas, J, {{"delta_p", 3}, {"delta_q", 3}, {"delta_v", 3}}, {{"bg", 3}, {"ba", 3}}, 1e-9);
  EXPECT_TRUE(check.ok) << check.message;
}

TEST(Preintegration, FirstOrderCorrectionErrsQuadratically) {
  const ImuSegment segment = Motion().segment(kFrom, kTo, Duration{5'000'000}, kBias);
  const auto error = [&](double scale) {
    const ImuBias moved{kBias.gyro_radps + scale * Vec3(1, -1, 0.5), kBias.accel_mps2 + scale * Vec3(-1, 2, 1)};
    const ImuDeltas corrected = integrated(segment, kBias).corrected(moved);
    return (corrected.p - integrated(segment, moved).delta_p()).norm();
  };
  EXPECT_NEAR(error(2e-2) / error(1e-2), 4, 0.2);
}

TEST(Preintegration, RepropagationEqualsIntegratingAnew) {
  const ImuSegment segment = Motion().segment(kFrom, kTo, Duration{5'000'000}, kBias);
  Preintegration p = integrated(segment, {});
  EXPECT_TRUE(p.needs_repropagation(kBias));
  p.repropagate(kBias);
  EXPECT_FALSE(p.needs_repropagation(kBias));
  const Preintegration fresh = integrated(segment, kBias);
  EXPECT_EQ(p.delta_p(), fresh.delta_p());
  EXPECT_EQ(p.delta_q().coeffs(), fresh.delta_q().coeffs());
  EXPECT_EQ(p.covariance(), fresh.covariance());
}

TEST(Preintegration, AppendEqualsIntegratingInOneGo) {
  const Motion motion;
  const Time middle{1'233'000'000};
  const Duration period{5'000'000};
  const ImuSegment first = motion.segment(kFrom, middle, period, kBias), second = motion.segment(middle, kTo, period, kBias);
  Preintegration together(ImuNoise{}, kBias);
  together.integrate(first);
  together.integrate(second);
  Preintegration joined = integrated(first, kBias);
  joined.append(integrated(second, ImuBias{}));  // the other's bias does not matter
  EXPECT_EQ(joined.dt().ns, (kTo - kFrom).ns);
  EXPECT_LT((joined.delta_p() - together.delta_p()).norm(), 1e-12);
  EXPECT_LT((joined.delta_v() - together.delta_v()).norm(), 1e-12);
  EXPECT_LT((joined.delta_q().coeffs() - together.delta_q().coeffs()).norm(), 1e-12);
  EXPECT_LT((joined.covariance() - together.covariance()).norm(), 1e-12);
  EXPECT_LT((joined.J_p_bg() - together.J_p_bg()).norm(), 1e-12);
  EXPECT_LT((joined.sqrt_information() - together.sqrt_information()).norm() / together.sqrt_information().norm(), 1e-12);
}

TEST(Preintegration, SqrtInformationIsTheUpperRootOfTheInverse) {
  const Preintegration p = integrated(Motion().segment(kFrom, Time{1'050'000'000}, Duration{5'000'000}), {});
  const Mat15& U = p.sqrt_information();
  EXPECT_LT((U.transpose() * U * p.covariance() - Mat15::Identity()).norm(), 1e-6);
  EXPECT_EQ(Mat15(U.triangularView<Eigen::StrictlyLower>()).norm(), 0);
}

// 3000 seeded runs with white noise and bias random walk: the spread of the errors is the covariance.
TEST(Preintegration, CovarianceMatchesMonteCarlo) {
  ImuNoise noise;
  noise.gyro_noise_density_radps_rthz = 2e-3;
  noise.accel_noise_density_mps2_rthz = 2e-2;
  noise.gyro_random_walk_radps2_rthz = 5e-3;  // strong, so that its share of the motion shows
  noise.accel_random_walk_mps3_rthz = 8e-2;
  const Motion motion;
  const ImuSegment clean = motion.segment(kFrom, kTo, Duration{5'000'000});
  const Preintegration reference = integrated(clean, {}, noise);
  Rng rng(11);
  constexpr int kRuns = 3000;
  Mat15 scatter = Mat15::Zero();
  double chi2 = 0;
  for (int run = 0; run < kRuns; ++run) {
    ImuSegment noisy = clean;
    ImuBias walk;
    for (std::size_t k = 0; k < noisy.samples.size(); ++k) {
      noisy.samples[k].gyro_radps += walk.gyro_radps;
      noisy.samples[k].accel_mps2 += walk.accel_mps2;
      if (k + 1 == noisy.samples.size()) break;
      const double root_dt = std::sqrt((noisy.samples[k + 1].t - noisy.samples[k].t).seconds());
      walk.gyro_radps += noise.gyro_random_walk_radps2_rthz * root_dt * test::normal3(rng);
      walk.accel_mps2 += noise.accel_random_walk_mps3_rthz * root_dt * test::normal3(rng);
    }
    test::add_noise(noisy, noise, rng);
    const Preintegration p = integrated(noisy, {}, noise);
    Vec15 e;  // truth less measurement, as the residual has it
    e << reference.delta_p() - p.delta_p(), so3_log(p.delta_q().conjugate() * reference.delta_q()),
        reference.delta_v() - p.delta_v(), walk.gyro_radps, walk.accel_mps2;
    scatter += e * e.transpose() / kRuns;
    chi2 += e.dot(reference.covariance().llt().solve(e)) / kRuns;
  }
  for (int k = 0; k < 15; ++k) EXPECT_NEAR(scatter(k, k) / reference.covariance()(k, k), 1, 0.12) << "variance " << k;
  EXPECT_NEAR(chi2, 15, 0.6);  // mean of 3000 chi-square(15): 15 +- 0.1; the rest is the ends of the trapezium
  // the correlation of velocity and final bias, made by the random walk alone
  for (int k = 0; k < 3; ++k) {
    const auto correlation = [&](const Mat15& P) {
      return P(nav::theta + k, nav::bg + k) / std::sqrt(P(nav::theta + k, nav::theta + k) * P(nav::bg + k, nav::bg + k));
    };
    EXPECT_NEAR(correlation(scatter), correlation(reference.covariance()), 0.06);
  }
}

/// What the interval gains or loses where its end is another is what its covariance says.
TEST(Preintegration, AnEndOfUncertainTimeMovesAsTheBodyDoes) {
  const Motion motion;
  const double later_s = 0.001;
  const Vec3 gravity = level_gravity();
  Preintegration p = integrated(motion.segment(kFrom, kTo, Duration{1'000'000}, kBias), kBias);
  const Mat15 before = p.covariance();
  p.loosen_end(later_s, motion.state(kTo.seconds(), kBias), gravity);
  const Mat15 added = p.covariance() - before;
  const auto at_end = motion.state(kTo.seconds(), kBias), after = motion.state(kTo.seconds() + later_s, kBias);
  const Mat3 to_begin = motion.state(kFrom.seconds(), kBias).T_FB.q.conjugate().toRotationMatrix();
  Eigen::Matrix<double, 9, 1> moved;
  moved << to_begin * (after.T_FB.p - at_end.T_FB.p), so3_log(at_end.T_FB.q.conjugate() * after.T_FB.q),
      to_begin * (after.v_FB - at_end.v_FB);
  EXPECT_NEAR((added.topLeftCorner<9, 9>() - moved * moved.transpose()).norm(), 0, 0.01 * moved.squaredNorm());
  EXPECT_EQ((added.rightCols<6>().norm()), 0);
  p.repropagate(kBias);
  EXPECT_NEAR((p.covariance() - before - added).norm(), 0, 1e-15);
  const Mat15 U = p.sqrt_information();
  EXPECT_NEAR((U * p.covariance() * U.transpose() - Mat15::Identity()).norm(), 0, 1e-6);
}

TEST(Preintegration, TheEndThatCountsIsThatOfTheLastIntervalJoined) {
  const Motion motion;
  const Time middle = kFrom + Duration{(kTo - kFrom).ns / 2};
  Preintegration first = integrated(motion.segment(kFrom, middle, Duration{5'000'000}, kBias), kBias);
  Preintegration second = integrated(motion.segment(middle, kTo, Duration{5'000'000}, kBias), kBias);
  Preintegration exact = first, whole = first;
  exact.append(second);
  first.loosen_end(0.01, motion.state(middle.seconds(), kBias), level_gravity());
  first.append(second);
  EXPECT_EQ(first.covariance(), exact.covariance());
  second.loosen_end(0.01, motion.state(kTo.seconds(), kBias), level_gravity());
  whole.append(second);
  exact.loosen_end(0.01, motion.state(kTo.seconds(), kBias), level_gravity());
  EXPECT_NEAR((whole.covariance() - exact.covariance()).norm(), 0, 1e-12);
}

TEST(Preintegration, MissingReadingsInflateTheCovariance) {
  const Motion motion;
  ImuSegment whole = motion.segment(kFrom, kTo, Duration{5'000'000}), one_lost = whole, broken = whole;
  one_lost.samples.erase(one_lost.samples.begin() + 40);
  broken.samples.erase(broken.samples.begin() + 20, broken.samples.begin() + 80);
  broken.longest_gap = Duration{305'000'000};
  const Preintegration a = integrated(whole, {}), b = integrated(one_lost, {}), c = integrated(broken, {});
  EXPECT_EQ(a.longest_gap_s(), 0);
  EXPECT_NEAR(c.longest_gap_s(), 0.305, 1e-9);
  EXPECT_LT(b.covariance().trace(), 1.5 * a.covariance().trace());
  const NavState<W> i = motion.state(kFrom.seconds()), j = motion.state(kTo.seconds());
  const Vec15 error = c.predict(i, level_gravity()).boxminus(j);
  for (int k = 0; k < 9; ++k)
    EXPECT_LT(std::abs(error(k)), 3.5 * std::sqrt(c.covariance()(k, k))) << "the gap's error is covered, component " << k;
  EXPECT_GT(std::sqrt(c.covariance()(nav::v, nav::v)), 0.3);
}

/// Whatever rate is declared: what lies between the readings of a slow IMU is not known.
TEST(Preintegration, ASlowImuKnowsLessThanItsNoiseSays) {
  const auto sigma_v = [](double declared_hz, int step_ms) {
    ImuNoise noise;
    noise.rate_hz = declared_hz;
    ImuSegment segment;
    for (int t = 0; t <= 1000; t += step_ms) segment.samples.push_back({Time{t * 1'000'000LL}, Vec3::Zero(), Vec3(0, 0, 9.81)});
    segment.longest_gap = Duration{step_ms * 1'000'000LL};
    Preintegration whole(noise, {});
    whole.integrate(segment);
    return std::sqrt(whole.covariance()(nav::v, nav::v));
  };
  const double fast = sigma_v(200, 5);
  EXPECT_NEAR(sigma_v(100, 10), fast, 0.01 * fast) << "white noise alone, whatever the rate";
  EXPECT_GT(sigma_v(20, 50), 5 * fast);
  EXPECT_NEAR(sigma_v(20, 50), sigma_v(200, 50), 1e-12);
}

TEST(Preintegration, AnEmptySegmentAddsNothing) {
  Preintegration p(ImuNoise{}, {});
  p.integrate({});
  EXPECT_TRUE(p.empty());
  EXPECT_EQ(p.dt_s(), 0);
  EXPECT_EQ(p.sqrt_information().norm(), 0);
}

}  // namespace preintegration_test
}  // namespace fbvins
