// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/range_factor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "fbvins/core/rng.hpp"
#include "fbvins/estimator/factor_test.hpp"
#include "tests/support/window_test_scene.hpp"

namespace fbvins {
namespace range_factor_test {

WindowProblem window_with_floor() {
  WindowProblem p = test::make_window(false).problem;
  p.own = {{3, "floor", Eigen::VectorXd::Constant(1, -1.1)}};
  return p;
}

TEST(HeightFactor, IsSound) {
  WindowProblem p = window_with_floor();
  for (const int frame : {0, 3, 5}) {
    const double height = p.frames[frame].state.T_FB.p.z();
    for (const double below : {height + 1.1, height + 1.15, height + 2.5})  // right, a few sigmas off, an outlier
      test::expect_sound(HeightFactor(FrameId{frame}, 3, Vec3(0.1, 0.05, -below), 0.02), p);
  }
  p.weights.estimate_tilt = false;
  test::expect_sound(HeightFactor(FrameId{2}, 3, Vec3(0.1, 0.05, -1.3), 0.02), p);
}

TEST(HeightFactor, IsHandedOnToTheNextFrame) {
  const WindowProblem p = window_with_floor();
  const HeightFactor factor(FrameId{2}, 3, Vec3(0.1, 0.05, -1.3), 0.02);
  const Pose<B, B> T_32 = p.frames[3].state.T_FB.inverse() * p.frames[2].state.T_FB;
  const auto left = factor.without({FrameId{2}, FrameId{3}, T_32});
  ASSERT_NE(left, nullptr);
  EXPECT_FALSE(left->touches(FrameId{2}));
  const auto& handed_on = dynamic_cast<const HeightFactor&>(*left);
  const Vec3 before = p.frames[2].state.T_FB * factor.point_B(), after = p.frames[3].state.T_FB * handed_on.point_B();
  EXPECT_LT((after - before).norm(), 1e-12);
  EXPECT_GT(handed_on.sigma_m(), factor.sigma_m());
}

/// A vehicle that flies level at 1 m/s, 1.5 m high and a little up and down, above things of some height.
class Flight {
 public:
  /// Which floor (its own variable) the reading of each frame is taken to lie on; -1: none.
  std::vector<int> fly(double seconds, const std::function<double(double t_s)>& surface_m,
                       const std::function<double(double distance_m)>& reads = {}) {
    std::vector<int> out;
    for (const double end_s = t_s_ + seconds; t_s_ < end_s; t_s_ += 0.05) {
      TrackedFrame tracked;
      Frame frame;
      frame.id = FrameId{++id_}, frame.t = tracked.t = Time{} + Duration::from_seconds(t_s_);
      frame.state.T_FB.p = Vec3(t_s_, 0, 1.5 + 0.3 * std::sin(t_s_));
      frame.state.v_FB = Vec3(1, 0, 0.3 * std::cos(t_s_));
      RangeSample r;
      r.t = frame.t, r.sigma_m = 0.01;
      r.distance_m = frame.state.T_FB.p.z() - surface_m(t_s_) + 0.01 * rng_.normal();
      if (reads) r.distance_m = reads(r.distance_m);
      tracked.aiding = {r};
      const std::vector<TrackedFeature> none;
      const auto made = maker_.make({tracked, none, frame, window_, calibration_});
      out.push_back(made.empty() ? -1 : made.front()->variables().back().own);
    }
    return out;
  }
  const SlidingWindow& window() const { return window_; }
  HealthReason doubt() const { return maker_.doubt(); }

 private:
  SlidingWindow window_{EstimatorOptions{}, WindowWeights{}};
  RangeMaker maker_{0.015};
  Calibration calibration_;
  Rng rng_{5};
  double t_s_ = 0;
  int id_ = 0;
};

double level(double) { return 0; }

TEST(RangeMaker, ALevelFloorIsOneVariable) {
  Flight flight;
  for (const int floor : flight.fly(10, level)) EXPECT_EQ(floor, 0);
  ASSERT_EQ(flight.window().own().size(), 1u);
  EXPECT_NEAR(flight.window().own(0)->value(0), 0, 0.05);
  EXPECT_EQ(flight.doubt(), HealthReason::none);
}

TEST(RangeMaker, ATableIsAnotherFloorAndTheOneBelowIsFoundAgain) {
  Flight flight;
  flight.fly(2, level);
  const std::vector<int> above = flight.fly(1.5, [](double) { return 0.72; });
  EXPECT_EQ(above.front(), -1) << "nobody knows yet what it is";
  EXPECT_EQ(above.back(), 1);
  EXPECT_EQ(flight.fly(2, level).front(), 0) << "at once";
  EXPECT_EQ(flight.doubt(), HealthReason::none);
}

TEST(RangeMaker, SingleWrongReadingsAreLeftOut) {
  Flight flight;
  Rng rng(9);
  flight.fly(1, level);
  int used = 0, frames = 0;
  bool wrong = false;
  const auto spoilt = [&](double d) { return (wrong = rng.below(5) == 0) ? d + 0.5 + rng.uniform(0, 3) : d; };
  for (int k = 0; k < 200; ++k) {
    const int floor = flight.fly(0.04, level, spoilt).front();
    EXPECT_EQ(floor == -1, wrong) << k;
    ++frames, used += floor == 0;
  }
  EXPECT_GT(used, frames / 2);
  EXPECT_EQ(flight.window().own().size(), 1u);
  EXPECT_EQ(flight.doubt(), HealthReason::none);
}

TEST(RangeMaker, ASensorThatSaysAnythingIsDoubtedAndForgivenLater) {
  Flight flight;
  Rng rng(9);
  flight.fly(1, level);
  flight.fly(3, level, [&](double) { return rng.uniform(0.2, 8); });
  EXPECT_EQ(flight.doubt(), HealthReason::range_disagrees);
  flight.fly(3, level);
  EXPECT_EQ(flight.doubt(), HealthReason::none);
}

TEST(RangeMaker, WhatItCannotMeasureIsNoReading) {
  Flight flight;
  for (const double d : {std::numeric_limits<double>::infinity(), 0.0, 41.0})
    for (const int floor : flight.fly(0.5, level, [&](double) { return d; })) EXPECT_EQ(floor, -1);
  EXPECT_TRUE(flight.window().own().empty());
  EXPECT_EQ(flight.doubt(), HealthReason::none);
}

}  // namespace range_factor_test
}  // namespace fbvins
