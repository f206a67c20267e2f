// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/barometer_factor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "fbvins/core/rng.hpp"
#include "fbvins/estimator/factor_test.hpp"
#include "fbvins/estimator/height_factor.hpp"
#include "tests/support/window_test_scene.hpp"

namespace fbvins {
namespace barometer_factor_test {

WindowProblem window_with_levels() {
  WindowProblem p = test::make_window(false).problem;
  p.own = {{3, "pressure level", Eigen::VectorXd::Constant(1, -1.1)}, {5, "pressure level", Eigen::VectorXd::Constant(1, -0.9)}};
  return p;
}

TEST(Barometer, AMetreIsTwelvePascals) {
  EXPECT_NEAR(pressure_height_m(101'325 - 12, 101'325), 1, 0.01);
  EXPECT_EQ(pressure_height_m(98'000, 98'000), 0);
}

TEST(Barometer, FactorsAreSound) {
  WindowProblem p = window_with_levels();
  for (const bool tilt : {true, false}) {
    p.weights.estimate_tilt = tilt;
    for (const int frame : {0, 4}) {
      const double height_m = p.frames[frame].state.T_FB.p.z();
      for (const double above_m : {height_m + 1.1, height_m + 4})  // right, an outlier
        test::expect_sound(HeightFactor(FrameId{frame}, 3, Vec3::Zero(), 0.1, above_m), p);
      test::expect_sound(LevelDrift(FrameId{frame}, 3, 5, 0.05), p);
    }
  }
}

TEST(Barometer, DriftIsHandedOnToTheNextFrame) {
  const WindowProblem p = window_with_levels();
  const LevelDrift drift(FrameId{2}, 3, 5, 0.05);
  const auto left = drift.without({FrameId{2}, FrameId{3}, {}});
  ASSERT_NE(left, nullptr);
  EXPECT_FALSE(left->touches(FrameId{2}));
  EXPECT_EQ(left->cost(p), drift.cost(p));
}

/// A vehicle that goes up and down by half a metre.
class Flight {
 public:
  /// Whether the reading of each frame is used. `adds_m`: what the air adds to the height.
  std::vector<bool> fly(double seconds, const std::function<double(double t_s)>& adds_m) {
    std::vector<bool> out;
    for (const double end_s = t_s_ + seconds; t_s_ < end_s; t_s_ += 0.05) {
      TrackedFrame tracked;
      Frame frame;
      frame.id = FrameId{++id_}, frame.t = tracked.t = Time{} + Duration::from_seconds(t_s_);
      frame.state.T_FB.p.z() = 0.5 * std::sin(0.5 * t_s_);
      const double height_m = frame.state.T_FB.p.z() + adds_m(t_s_) + 0.1 * rng_.normal();
      tracked.aiding = {PressureSample{frame.t, 101'000 - 11.975 * height_m, 1.2}};
      const std::vector<TrackedFeature> none;
      out.push_back(!maker_.make({tracked, none, frame, window_, calibration_}).empty());
    }
    return out;
  }
  HealthReason doubt() const { return maker_.doubt(); }
  std::size_t levels() const { return window_.own().size(); }
  int frames() const { return id_; }

 private:
  SlidingWindow window_{EstimatorOptions{}, WindowWeights{}};
  BarometerMaker maker_{0.03};
  Calibration calibration_;
  Rng rng_{5};
  double t_s_ = 0;
  int id_ = 0;
};

double still(double) { return 0; }

TEST(BarometerMaker, ReadingsAreUsedAndLevelsTakeTurns) {
  Flight flight;
  for (const bool used : flight.fly(10, still)) EXPECT_TRUE(used);
  EXPECT_LE(flight.levels(), 2u) << "those that ended are gone where no frame is in the window";
  EXPECT_EQ(flight.doubt(), HealthReason::none);
}

TEST(BarometerMaker, ADoorIsLeftOut) {
  Flight flight;
  flight.fly(3, still);
  for (const bool used : flight.fly(1, [](double) { return -3.0; })) EXPECT_FALSE(used);
  for (const bool used : flight.fly(2, still)) EXPECT_TRUE(used);
  EXPECT_EQ(flight.doubt(), HealthReason::none);
}

TEST(BarometerMaker, AJumpThatStaysIsANewLevel) {
  Flight flight;
  flight.fly(3, still);
  const std::vector<bool> after = flight.fly(4, [](double) { return 3.0; });
  EXPECT_FALSE(after.front());
  EXPECT_TRUE(after.back());
  EXPECT_EQ(flight.doubt(), HealthReason::none);
}

TEST(BarometerMaker, ASensorThatSaysAnythingIsNamed) {
  Flight flight;
  Rng rng(9);
  flight.fly(2, still);
  flight.fly(8, [&](double) { return rng.uniform(-30, 30); });
  EXPECT_EQ(flight.doubt(), HealthReason::pressure_disagrees);
}

}  // namespace barometer_factor_test
}  // namespace fbvins
