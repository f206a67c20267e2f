// SPDX-License-Identifier: Apache-2.0
// The readings between two neighbouring frames (docs/derivations/preintegration.md, P17-P24; window.md, W15). The window keeps
// them as Frame::imu, which joins neighbours when a frame between them is dropped; the factor is made from that for each problem.
#pragma once

#include <memory>
#include <utility>

#include "fbvins/estimator/factor.hpp"
#include "fbvins/imu/preintegration.hpp"

namespace fbvins {

class ImuFactor : public Factor {
 public:
  ImuFactor(FrameId from, FrameId to, std::shared_ptr<const Preintegration> readings)
      : from_(from), to_(to), readings_(std::move(readings)) {}

  std::string_view name() const override { return "imu"; }
  std::vector<Variable> variables() const override {
    return {Variable::pose_of(from_), Variable::motion_of(from_), Variable::pose_of(to_), Variable::motion_of(to_),
            Variable::tilt_of_gravity()};
  }
  double cost(const WindowProblem& window) const override;
  double linearise(const WindowProblem& window, NormalEquations& out) const override;
  /// Frame::imu of the successor is joined instead.
  std::shared_ptr<const Factor> without(const DroppedFrame&) const override { return nullptr; }

  FrameId to() const { return to_; }
  const std::shared_ptr<const Preintegration>& readings() const { return readings_; }

 private:
  FrameId from_, to_;
  std::shared_ptr<const Preintegration> readings_;
};

}  // namespace fbvins
