// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/pose_refinement.hpp"

#include <gtest/gtest.h>

#include "tests/support/simulated_flight.hpp"

namespace fbvins {
namespace pose_refinement_test {

/// The features of a simulated frame with the positions of their points.
struct Seen {
  test::SimulatedFlight flight{test::Motion(0.5, 0.3), 31};
  TrackedFrame frame;
  Calibration calibration{{flight.rig.T_BC0(), flight.rig.T_BC(1)}};
  Pose<G, B> truth;
  std::vector<LandmarkObservation> observations;

  Seen() {
    flight.pixel_sigma_px = 0.3;
    frame = flight.frame(0);
    truth = flight.truth<G>(0).T_FB;
    for (const TrackedFeature& f : frame.features) observations.push_back({nearest(f), &f});
  }
  /// The point whose projection is nearest to the feature.
  Vec3 nearest(const TrackedFeature& f) const {
    Vec3 best = Vec3::Zero();
    double least = 1e9;
    for (const Vec3& p_G : flight.points()) {
      const Vec3 p_C = calibration.T_BC0().inverse() * (truth.inverse() * p_G);
      if (p_C.z() < 0.2) continue;
      const double distance = (p_C.head<2>() / p_C.z() - f.left()->normalised).norm();
      if (distance < least) least = distance, best = p_G;
    }
    return best;
  }
  Pose<G, B> guess() const { return truth.boxplus(Vec3(0.1, -0.2, 0.1), Vec3(0.03, 0.02, -0.05)); }
};

TEST(PoseRefinement, FindsThePoseFromAGuess) {
  Seen s;
  const PoseRefinement found = refine_pose(s.observations, s.calibration, s.guess());
  EXPECT_TRUE(found.converged);
  EXPECT_LT((found.T_GB.p - s.truth.p).norm(), 0.01);
  EXPECT_LT(so3_log(s.truth.q.conjugate() * found.T_GB.q).norm(), 0.003);
  EXPECT_GT(found.inliers, 0.9 * static_cast<double>(s.observations.size()));
}

TEST(PoseRefinement, OutliersAreNoInliers) {
  Seen s;
  const std::size_t wrong = s.observations.size() / 5;
  for (std::size_t k = 0; k < wrong; ++k) s.observations[k].p_G += Vec3(0.5, -0.5, 0.5);
  const PoseRefinement found = refine_pose(s.observations, s.calibration, s.guess());
  EXPECT_LT((found.T_GB.p - s.truth.p).norm(), 0.05);
  EXPECT_LE(found.inliers, static_cast<int>(s.observations.size() - wrong) + 2);
}

TEST(PoseRefinement, WithoutFeaturesItDoesNotConverge) {
  Seen s;
  const PoseRefinement found = refine_pose({}, s.calibration, s.guess());
  EXPECT_FALSE(found.converged);
  EXPECT_EQ(found.inliers, 0);
  EXPECT_EQ(found.T_GB.p, s.guess().p);
}

}  // namespace pose_refinement_test
}  // namespace fbvins
