// SPDX-License-Identifier: Apache-2.0
// Smooth seeded trajectories for the tests of this folder.
#pragma once

#include <cmath>

#include "fbvins/core/rng.hpp"
#include "fbvins/eval/association.hpp"

namespace fbvins::eval_test {

inline Vec3 normal3(Rng& rng, double sigma) { return sigma * Vec3(rng.normal(), rng.normal(), rng.normal()); }

/// A winding flight of n poses, 20 a second.
inline Trajectory<AnyWorld> flight(int n) {
  Trajectory<AnyWorld> trajectory;
  for (int i = 0; i < n; ++i) {
    const double s = 0.05 * i;
    const Vec3 p(2 * std::sin(0.5 * s), 1.5 * std::cos(0.3 * s), 1 + 0.4 * std::sin(0.9 * s));
    const Quat q = so3_exp(Vec3(0.3 * std::sin(s), 0.2 * std::cos(0.7 * s), 0.4 * s));
    trajectory.push_back({Time{1'403'636'580'000'000'000 + 50'000'000LL * i}, {q, p}});
  }
  return trajectory;
}

inline Trajectory<AnyWorld> noisy(Trajectory<AnyWorld> trajectory, double sigma_m, double sigma_rad, std::uint64_t seed) {
  Rng rng(seed);
  for (StampedPose<AnyWorld>& pose : trajectory) {
    const Vec3 dp = normal3(rng, sigma_m);
    pose.T = pose.T.boxplus(dp, normal3(rng, sigma_rad));
  }
  return trajectory;
}

}  // namespace fbvins::eval_test
