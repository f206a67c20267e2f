// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_vertical.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace place_vertical_test {

/// A gauge that leans by `lean_rad` in truth and takes itself for level, and a place that sees the truth up to its noise.
struct Leaning {
  Quat q_MG;
  GaugeState gauge;

  Leaning(double lean_rad, double up_sigma_rad) : q_MG(so3_exp(Vec3(0, lean_rad, 0))) {
    gauge.up_sigma_rad = up_sigma_rad;
    gauge.T_GB.q = so3_exp(Vec3(0.1, -0.2, 1.3));
  }
  MeasuredPose place(double sigma_rad, Rng& rng) const {
    MeasuredPose seen;
    seen.T_MB.q = q_MG * gauge.T_GB.q * so3_exp(sigma_rad * Vec3(rng.normal(), rng.normal(), rng.normal()));
    seen.tilt_variance_rad2 = sigma_rad * sigma_rad;
    return seen;
  }
  double error_rad(const LevelledGauge& level) const { return (level.q_LG.conjugate() * Vec3::UnitZ() - up_G()).norm(); }
  Vec3 up_G() const { return q_MG.conjugate() * Vec3::UnitZ(); }
};

TEST(PlaceVertical, WithoutPlacesItIsThatOfGravity) {
  Leaning flight(0.02, 0.015);
  flight.gauge.q_LG = so3_exp(Vec3(0.03, -0.01, 0));
  PlaceVertical vertical;
  vertical.advance(0.1);
  const LevelledGauge level = vertical.level(flight.gauge);
  EXPECT_EQ(level.q_LG.coeffs(), flight.gauge.q_LG.coeffs());
  EXPECT_EQ(level.up_sigma_rad, 0.015);
}

TEST(PlaceVertical, PlacesCorrectAVerticalThatIsUncertainAndItsErrorIsAsSaid) {
  const Leaning flight(1.5 * kDegree, 1 * kDegree);
  Rng rng(1);
  double before = flight.error_rad({});
  EXPECT_NEAR(before, 1.5 * kDegree, 1e-4);
  PlaceVertical vertical;
  for (int i = 0; i < 10; ++i) vertical.add(flight.gauge, flight.place(0.2 * kDegree, rng));
  const LevelledGauge level = vertical.level(flight.gauge);
  EXPECT_LT(flight.error_rad(level), 0.2 * kDegree);
  EXPECT_LT(flight.error_rad(level), 3 * level.up_sigma_rad);
  EXPECT_LT(level.up_sigma_rad, 0.2 * kDegree);
}

TEST(PlaceVertical, TheMoreCertainOneCounts) {
  const Leaning flight(1 * kDegree, 0.05 * kDegree);  // gravity is certain: what leans is the place
  Rng rng(2);
  PlaceVertical vertical;
  vertical.add(flight.gauge, flight.place(0.5 * kDegree, rng));
  EXPECT_GT(flight.error_rad(vertical.level(flight.gauge)), 0.8 * kDegree);
}

TEST(PlaceVertical, APlaceThatContradictsGravityIsNotUsed) {
  const Leaning flight(8 * kDegree, 1 * kDegree);
  Rng rng(3);
  PlaceVertical vertical;
  vertical.add(flight.gauge, flight.place(0.2 * kDegree, rng));
  EXPECT_EQ(vertical.level(flight.gauge).up_sigma_rad, flight.gauge.up_sigma_rad);
}

TEST(PlaceVertical, WhatTheOdometryDriftsMakesNewPlacesCountMore) {
  const Leaning then(0, 1 * kDegree), now(1 * kDegree, 1 * kDegree);
  const auto error_after = [&](double drift_rad) {
    Rng rng(4);
    PlaceVertical vertical;
    for (int i = 0; i < 20; ++i) vertical.add(then.gauge, then.place(0.1 * kDegree, rng));
    vertical.advance(drift_rad * drift_rad);
    vertical.add(now.gauge, now.place(0.1 * kDegree, rng));
    return now.error_rad(vertical.level(now.gauge));
  };
  EXPECT_GT(error_after(0), 0.7 * kDegree);
  EXPECT_LT(error_after(1 * kDegree), 0.2 * kDegree);
}

}  // namespace place_vertical_test
}  // namespace fbvins
