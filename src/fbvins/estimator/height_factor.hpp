// SPDX-License-Identifier: Apache-2.0
// A point of the body lies on a level that is a variable of the window, or so far above it: the floor that a beam hits
// (range_factor.hpp), what a barometer calls zero (barometer_factor.hpp). docs/derivations/aiding.md, R1-R2.
#pragma once

#include <memory>
#include <vector>

#include "fbvins/estimator/factor.hpp"
#include "fbvins/geometry/pose.hpp"

namespace fbvins {

class HeightFactor : public Factor {
 public:
  /// `point_B`: in the body of the frame. `level`: number of the own variable.
  HeightFactor(FrameId frame, int level, const Vec3& point_B, double sigma_m, double above_m = 0)
      : frame_(frame), level_(level), point_B_(point_B), sigma_m_(sigma_m), above_m_(above_m) {}

  std::string_view name() const override { return "height"; }
  std::vector<Variable> variables() const override {
    return {Variable::pose_of(frame_), Variable::tilt_of_gravity(), Variable::own_one(level_)};
  }
  double cost(const WindowProblem& window) const override;
  double linearise(const WindowProblem& window, NormalEquations& out) const override;
  /// The successor has it instead: the motion between the two is known far better.
  std::shared_ptr<const Factor> without(const DroppedFrame& dropped) const override;

  const Vec3& point_B() const { return point_B_; }
  double sigma_m() const { return sigma_m_; }

 private:
  double residual(const WindowProblem& window) const;

  FrameId frame_;
  int level_;
  Vec3 point_B_;
  double sigma_m_, above_m_;
};

}  // namespace fbvins
