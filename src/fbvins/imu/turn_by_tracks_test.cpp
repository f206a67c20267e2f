// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/turn_by_tracks.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace turn_by_tracks_test {

constexpr double kSigma = 1e-3, kLineDelay_s = 50e-6;

/// Tracks of two images; `moved`: the camera, in the axes of the second.
struct Scene {
  PredictedTurnOfPair truth{so3_exp(Vec3(0.05, -0.08, 0.03)).toRotationMatrix(),
                            {Vec3(0.5, -1, 0.2), Vec3(5, 20, -10)},
                            {Vec3(0.8, -0.6, 0.4), Vec3(-10, 15, 5)},
                            kLineDelay_s,
                            0.1};
  std::vector<SeenTwice> tracks;

  explicit Scene(const Vec3& moved) {
    Rng rng(5);
    for (int i = 0; i < 40; ++i) {
      const Vec3 a = Vec3(rng.uniform(-0.6, 0.6), rng.uniform(-0.5, 0.5), 1).normalized();
      const Vec3 noise(rng.normal(), rng.normal(), rng.normal());
      const Vec3 b = (truth.R.transpose() * a - moved / rng.uniform(2, 6) + kSigma * noise).normalized();
      const double rows_a = 450 * a.y() / a.z(), rows_b = 450 * b.y() / b.z();
      tracks.push_back({so3_exp(-truth.around_a.after(kLineDelay_s * rows_a)) * a,
                        so3_exp(-truth.around_b.after(kLineDelay_s * rows_b)) * b, kSigma, rows_a, rows_b});
    }
  }
  PredictedTurnOfPair off_by(const Vec3& turn, double line_delay_s) const {
    return {truth.R * so3_exp(turn).toRotationMatrix(), truth.around_a, truth.around_b, truth.line_delay_s + line_delay_s,
            truth.dt_s};
  }
};

TEST(TurnByTracks, SaysWhatTurnAndLineDelayAreOffBy) {
  for (const Vec3& moved : {Vec3(0, 0, 0), Vec3(0.01, 0, 0.01), Vec3(0.1, -0.05, 0.2)}) {
    const Scene scene(moved);
    const Vec3 turn(0.003, -0.002, 0.004);
    const TurnError error = turn_error(scene.tracks, scene.off_by(turn, 20e-6), {});
    const Eigen::Matrix4d covariance = error.A.inverse();
    const Eigen::Vector4d left = Eigen::Vector4d(turn.x(), turn.y(), turn.z(), 20e-6) - covariance * error.a;
    for (int i = 0; i < 4; ++i) EXPECT_LT(std::abs(left(i)), 3.5 * std::sqrt(covariance(i, i))) << moved.transpose() << ": " << i;
  }
}

/// So that the tracks of a pair need not be compared at each step.
TEST(TurnByTracks, TheCostOfATurnNearbyFollows) {
  const Scene scene(Vec3(0.05, 0.02, 0.1));
  const TurnError here = turn_error(scene.tracks, scene.off_by(Vec3::Zero(), 0), {});
  const Vec3 turn(1e-4, -1e-4, 2e-4);
  const TurnError there = turn_error(scene.tracks, scene.off_by(turn, 0), here.parallax);
  Eigen::Vector4d e;
  e << turn, 0;
  EXPECT_NEAR(there.cost, here.cost + 2 * here.a.dot(e) + e.dot(here.A * e), 0.02 * there.cost);
  const Eigen::Vector4d differs = there.a - here.a - here.A * e;
  EXPECT_LT(differs.dot(here.A.inverse() * differs), 0.2 * 0.2) << "in standard deviations";
}

}  // namespace turn_by_tracks_test
}  // namespace fbvins
