// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/marker_curve.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace marker_curve_test {

Pose<V, K> moving(double t) {
  return {so3_exp(Vec3(0.5 * std::sin(3 * t), 0.4 * std::cos(2 * t), 2 * t)), Vec3(std::sin(2 * t), std::cos(3 * t), 0.2 * t)};
}

TEST(MarkerCurve, FollowsAFlightBetweenItsPoses) {
  MarkerTrack track;
  for (int i = 0; i < 1000; ++i) track.push_back({Time{10'000'000LL * i}, moving(0.01 * i)});
  const MarkerCurve curve(track);
  double position = 0, rotation = 0;
  for (double t = 0.1; t < 9.8; t += 0.0137) {
    const auto pose = curve.at(Time{} + Duration::from_seconds(t));
    ASSERT_TRUE(pose.has_value());
    position = std::max(position, (pose->p - moving(t).p).norm());
    rotation = std::max(rotation, so3_log(pose->q.conjugate() * moving(t).q).norm());
  }
  EXPECT_LT(position, 5e-5);
  EXPECT_LT(rotation, 5e-5);
}

TEST(MarkerCurve, HasNoPoseInGapsAndBeyondItsEnds) {
  MarkerTrack track;
  for (int i = 0; i < 100; ++i)
    if (i < 40 || i > 50) track.push_back({Time{10'000'000LL * i}, moving(0.01 * i)});
  const MarkerCurve curve(track);
  const auto at = [&](double t) { return curve.at(Time{} + Duration::from_seconds(t)).has_value(); };
  EXPECT_TRUE(at(0.35));
  EXPECT_FALSE(at(0.45));
  EXPECT_FALSE(at(0.395)) << "the pieces on both sides of the gap are not joined";
  EXPECT_TRUE(at(0.55));
  EXPECT_FALSE(at(1.2));
  EXPECT_FALSE(MarkerCurve({}).at(Time{0}).has_value());
}

TEST(MarkerCurve, AveragesNoise) {
  Rng rng(3);
  MarkerTrack track;
  for (int i = 0; i < 2000; ++i) {
    const double x = rng.normal(), y = rng.normal(), z = rng.normal();
    track.push_back({Time{5'000'000LL * i}, moving(0.005 * i).boxplus(1e-3 * Vec3(x, y, z), Vec3::Zero())});
  }
  const MarkerCurve curve(track);
  double sum = 0;
  for (int i = 1; i < 99; ++i) sum += (curve.at(Time{100'000'000LL * i})->p - moving(0.1 * i).p).squaredNorm() / (3 * 98);
  EXPECT_LT(std::sqrt(sum), 0.8e-3);
}

}  // namespace marker_curve_test
}  // namespace fbvins
