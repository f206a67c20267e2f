// SPDX-License-Identifier: Apache-2.0
// A frame in which nothing moves: its velocity is zero.
#pragma once

#include "fbvins/estimator/factor_maker.hpp"

namespace fbvins {

class StandstillFactor : public Factor {
 public:
  explicit StandstillFactor(FrameId frame, double sigma_mps = 0.01) : frame_(frame), sigma_mps_(sigma_mps) {}

  std::string_view name() const override { return "standstill"; }
  std::vector<Variable> variables() const override { return {Variable::motion_of(frame_)}; }
  double cost(const WindowProblem& window) const override;
  double linearise(const WindowProblem& window, NormalEquations& out) const override;
  /// It says nothing of any other frame.
  std::shared_ptr<const Factor> without(const DroppedFrame&) const override { return nullptr; }

  FrameId frame() const { return frame_; }
  double sigma_mps() const { return sigma_mps_; }

 private:
  double information() const { return 1.0 / (sigma_mps_ * sigma_mps_); }

  FrameId frame_;
  double sigma_mps_;
};

class StandstillMaker : public FactorMaker {
 public:
  std::vector<std::shared_ptr<const Factor>> make(const NewFrame& frame) override;
};

}  // namespace fbvins
