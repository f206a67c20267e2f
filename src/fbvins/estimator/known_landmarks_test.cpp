// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/known_landmarks.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

namespace fbvins {
namespace known_landmarks_test {

const Pose<G, C0> kCamera{so3_exp(Vec3(0.3, -1.0, 0.4)), Vec3(1, 2, 3)};
const Vec3 kPoint{0.2, -0.1, 0.5};  // alpha, beta, rho: 2 m deep
const Mat3 kInformation = Vec3(1e6, 1e6, 1e5).asDiagonal();

Pose<G, B> body_at(const Vec3& p_G) { return {so3_exp(Vec3(0.1, 0.2, 0.3)), p_G}; }

TEST(KnownLandmarks, KeepPositionAndCovarianceOfTheTriangulation) {
  KnownLandmarkOptions options;
  options.position_sigma_m = 0.003;
  KnownLandmarks known(options);
  known.remember(TrackId{7}, kCamera, kPoint, kInformation);
  const auto prior = known.find(TrackId{7});
  ASSERT_TRUE(prior.has_value());
  const Vec3 p_C(0.4, -0.2, 2.0);
  EXPECT_LT((prior->p_G - kCamera * p_C).norm(), 1e-12);
  const Mat3 covariance = (prior->sqrt_information.transpose() * prior->sqrt_information).inverse();
  const Mat3 in_camera = kCamera.R().transpose() * covariance * kCamera.R();
  // Along the ray: sigma of 1/depth times depth squared; beside it the ray's own, at this depth; and 3 mm everywhere.
  const Vec3 ray = p_C / p_C.z();
  EXPECT_NEAR(in_camera(2, 2), 16e-5 * 1.0 + 9e-6, 1e-12);
  const Mat3 expected = 16e-5 * ray * ray.transpose() + Mat3(Vec3(4e-6, 4e-6, 0).asDiagonal()) + 9e-6 * Mat3::Identity();
  EXPECT_LT((in_camera - expected).norm(), 1e-12);
}

TEST(KnownLandmarks, KeepTheirFirstPositionUntilForgotten) {
  KnownLandmarks known{KnownLandmarkOptions{}};
  known.remember(TrackId{7}, kCamera, kPoint, kInformation);
  const Vec3 first = known.find(TrackId{7})->p_G;
  known.remember(TrackId{7}, kCamera, 1.1 * kPoint, kInformation);
  EXPECT_EQ(known.find(TrackId{7})->p_G, first);
  EXPECT_EQ(known.take_new().size(), 1u);
  EXPECT_TRUE(known.take_new().empty());
  known.forget(TrackId{7});
  EXPECT_FALSE(known.find(TrackId{7}).has_value());
  known.remember(TrackId{7}, kCamera, 1.1 * kPoint, kInformation);
  EXPECT_NE(known.find(TrackId{7})->p_G, first);
}

TEST(KnownLandmarks, AreNotThoseOfUncertainDepth) {
  KnownLandmarks known{KnownLandmarkOptions{}};
  known.remember(TrackId{3}, kCamera, kPoint, Vec3(1e6, 1e6, 1e3).asDiagonal());  // sigma of a sixteenth of the depth
  EXPECT_EQ(known.size(), 0u);
  known.remember(TrackId{4}, kCamera, kPoint, kInformation);
  EXPECT_EQ(known.size(), 1u);
}

TEST(KnownLandmarks, AreBoundedAndTheOldestGo) {
  KnownLandmarkOptions options;
  options.capacity = 10;
  KnownLandmarks known(options);
  for (int k = 0; k < 40; ++k) {
    known.set_host_uncertainty(body_at(Vec3(k, 0, 0)), 1e-7 * (k + 1) * Mat6::Identity());
    known.remember(TrackId{k}, kCamera, kPoint, kInformation);
    if (k % 4 == 0) known.forget(TrackId{k});
    if (k % 8 == 0) known.remember(TrackId{k}, kCamera, kPoint, kInformation);  // again
    EXPECT_LE(known.size(), 10u);
  }
  EXPECT_FALSE(known.find(TrackId{27}).has_value());
  EXPECT_FALSE(known.find(TrackId{36}).has_value()) << "forgotten";
  EXPECT_TRUE(known.find(TrackId{29}).has_value());
  EXPECT_TRUE(known.find(TrackId{32}).has_value()) << "forgotten, and remembered again";
  ASSERT_TRUE(known.find(TrackId{39}).has_value());
  // Uncertainties go with their landmarks, and those that stay are still found: variance 39 + 1 of the newest.
  known.set_active_priors(Vec3(39, 0, 0), std::array{*known.find(TrackId{39})});
  EXPECT_NEAR(known.with_map_covariance(body_at(Vec3(39, 0, 0)), Mat6::Zero())(0, 0), 40e-7, 1e-10);
}

TEST(KnownLandmarks, APoseHasTheUncertaintyOfTheMapThatConstrainsIt) {
  // Heading known to 2 mrad, the rest exactly, where the landmark was remembered; seen again from 5 m away.
  Mat6 heading = Mat6::Zero();
  const Pose<G, B> there{Quat::Identity(), Vec3(1, 0, 0)}, here{Quat::Identity(), Vec3(1, 5, 0)};
  heading(5, 5) = 4e-6;
  KnownLandmarks known{KnownLandmarkOptions{}};
  known.set_host_uncertainty(there, heading);
  known.remember(TrackId{1}, kCamera, kPoint, kInformation);
  const Mat6 window = 1e-8 * Mat6::Identity();
  known.set_active_priors(here.p, std::array{*known.find(TrackId{1})});
  const Mat6 held = known.with_map_covariance(here, window);
  EXPECT_NEAR(held(5, 5), 4e-6 + 2e-8, 1e-12) << "the window's share is doubled (K4)";
  EXPECT_NEAR(held(0, 0), 25 * 4e-6 + 2e-8, 1e-12) << "the lever of 5 m along y moves x";
  EXPECT_NEAR(held(1, 1), 2e-8, 1e-12);
  EXPECT_NEAR(held(0, 5), -5 * 4e-6, 1e-12);
  // With nothing of the map in view its uncertainty stays.
  known.set_active_priors(here.p, {});
  EXPECT_NEAR(known.with_map_covariance(here, window)(0, 0), 25 * 4e-6 + 1e-8, 1e-12);
  known.clear();
  EXPECT_NEAR(known.with_map_covariance(here, window)(0, 0), 1e-8, 1e-15);
}

}  // namespace known_landmarks_test
}  // namespace fbvins
