// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/own_sensor_factor.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/estimator/factor_test.hpp"
#include "tests/support/window_test_scene.hpp"

namespace fbvins {
namespace own_sensor_factor_test {

/// Speed through still air, of an instrument whose scale is the sensor's variable.
struct Airspeed : OwnMeasurement {
  double reads_mps = 0.7;
  Eigen::VectorXd residual(const BodyAtImage& body, const Eigen::VectorXd& scale) const override {
    const double speed = std::sqrt(body.v_GB.squaredNorm() + 0.01) + 0.1 * body.bias.gyro_radps.z();
    return Eigen::VectorXd::Constant(1, (scale(0) * speed - reads_mps) / 0.05);
  }
  bool is_of_motion() const override { return true; }
};

/// A height above the start, and a level's reading of two angles; without a variable.
struct Level : OwnMeasurement {
  Eigen::VectorXd residual(const BodyAtImage& body, const Eigen::VectorXd&) const override {
    Eigen::VectorXd r(3);
    const Vec3 up_B = body.T_GB.q.conjugate() * body.up_G;
    r << (body.up_G.dot(body.T_GB.p) - 0.2) / 0.1, (up_B.x() - 0.02) / 0.05, (up_B.y() - 0.01) / 0.05;
    return r;
  }
};

TEST(OwnSensorFactor, IsSound) {
  WindowProblem p = test::make_window(false).problem;
  p.own = {{3, "own sensor", Eigen::VectorXd::Constant(1, 1.1)}};
  for (const bool tilt : {true, false}) {
    p.weights.estimate_tilt = tilt;
    for (const int frame : {0, 4}) {
      const Time t{};
      test::expect_sound(OwnSensorFactor(FrameId{frame}, t, 3, std::make_shared<const Airspeed>()), p);
      test::expect_sound(OwnSensorFactor(FrameId{frame}, t, -1, std::make_shared<const Level>()), p);
    }
  }
}

TEST(OwnSensorFactor, IsTakenOverWhereItDoesNotDependOnMotion) {
  const WindowProblem p = test::make_window(false).problem;
  const Pose<B, B> T_32 = p.frames[3].state.T_FB.inverse() * p.frames[2].state.T_FB;
  const DroppedFrame dropped{FrameId{2}, FrameId{3}, T_32};
  const OwnSensorFactor level(FrameId{2}, Time{}, -1, std::make_shared<const Level>());
  const auto next = level.without(dropped);
  ASSERT_NE(next, nullptr);
  EXPECT_FALSE(next->touches(FrameId{2}));
  EXPECT_NEAR(next->cost(p), level.cost(p), 1e-9 * (1 + level.cost(p)));
  EXPECT_EQ(OwnSensorFactor(FrameId{2}, Time{}, 3, std::make_shared<const Airspeed>()).without(dropped), nullptr);
}

TEST(OwnSensorMaker, ItsVariableIsOneOfTheWindowAndFollowsItsEstimate) {
  struct Sensor : OwnSensor {
    std::vector<double> told;
    Eigen::VectorXd first_variable() const override { return Eigen::VectorXd::Constant(1, 1); }
    std::vector<std::shared_ptr<const OwnMeasurement>> measured(const BodyAtImage&, const Eigen::VectorXd& variable) override {
      told.push_back(variable(0));
      return {std::make_shared<const Airspeed>(), nullptr};
    }
  };
  const auto sensor = std::make_shared<Sensor>();
  OwnSensorMaker maker(sensor);
  SlidingWindow window(EstimatorOptions{}, WindowWeights{});
  const TrackedFrame tracked;
  const std::vector<TrackedFeature> none;
  Frame frame;
  frame.id = FrameId{1};
  const Calibration calibration;
  const NewFrame at{tracked, none, frame, window, calibration};
  EXPECT_EQ(maker.make(at).size(), 1u) << "what is null is left out";
  (void)maker.make(at);
  ASSERT_EQ(window.own().size(), 1u);
  window.clear();
  (void)maker.make(at);
  EXPECT_EQ(window.own().size(), 1u) << "of the new window";
  EXPECT_EQ(sensor->told, (std::vector<double>{1, 1, 1}));
}

}  // namespace own_sensor_factor_test
}  // namespace fbvins
