// SPDX-License-Identifier: Apache-2.0
// Measurements of sensors that others bring (include/fbvins/estimator/own_sensor.hpp) as factors, with derivatives by
// differences.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "fbvins/estimator/factor_maker.hpp"
#include "fbvins/estimator/own_sensor.hpp"

namespace fbvins {

class OwnSensorFactor : public Factor {
 public:
  /// `number`: of the own variable, -1 where there is none. `T_frame_image`: of a measurement that was taken over.
  OwnSensorFactor(FrameId frame, Time t, int number, std::shared_ptr<const OwnMeasurement> measurement,
                  const Pose<B, B>& T_frame_image = {})
      : frame_(frame), t_(t), number_(number), measurement_(std::move(measurement)), T_frame_image_(T_frame_image) {}

  std::string_view name() const override { return "own sensor"; }
  std::vector<Variable> variables() const override;
  double cost(const WindowProblem& window) const override;
  double linearise(const WindowProblem& window, NormalEquations& out) const override;
  std::shared_ptr<const Factor> without(const DroppedFrame& dropped) const override;

 private:
  Eigen::VectorXd residual(const NavState<G>& state, const Tilt& tilt, const Eigen::VectorXd& variable) const;
  Eigen::VectorXd variable_of(const WindowProblem& window) const;

  FrameId frame_;
  Time t_;
  int number_;
  std::shared_ptr<const OwnMeasurement> measurement_;
  Pose<B, B> T_frame_image_;
};

class OwnSensorMaker : public FactorMaker {
 public:
  explicit OwnSensorMaker(std::shared_ptr<OwnSensor> sensor) : sensor_(std::move(sensor)) {}
  std::vector<std::shared_ptr<const Factor>> make(const NewFrame& frame) override;

 private:
  std::shared_ptr<OwnSensor> sensor_;
  int number_ = -1;
};

}  // namespace fbvins
