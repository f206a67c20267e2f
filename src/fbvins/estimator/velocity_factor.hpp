// SPDX-License-Identifier: Apache-2.0
// A sensor of velocity in the body: wheels, optical flow over a known height (docs/velocity.md; docs/derivations/aiding.md,
// V1-V2). Readings far from the predicted velocity are left out: wheels slip, and flow over a moving shadow is of the shadow.
#pragma once

#include <memory>
#include <vector>

#include "fbvins/estimator/factor_maker.hpp"
#include "fbvins/estimator/sensor_doubt.hpp"

namespace fbvins {

/// What a reading says, as if it had been taken at the frame.
struct VelocityAtFrame {
  VelocitySample reading;
  Vec3 gyro_radps = Vec3::Zero();  ///< then, as read
};

class VelocityFactor : public Factor {
 public:
  VelocityFactor(FrameId frame, const VelocityAtFrame& measured) : frame_(frame), measured_(measured) {}

  std::string_view name() const override { return "velocity"; }
  std::vector<Variable> variables() const override { return {Variable::pose_of(frame_), Variable::motion_of(frame_)}; }
  double cost(const WindowProblem& window) const override;
  double linearise(const WindowProblem& window, NormalEquations& out) const override;
  /// The successor has it instead, with the change of velocity that is estimated between the two.
  std::shared_ptr<const Factor> without(const DroppedFrame& dropped) const override;

  const VelocityAtFrame& measured() const { return measured_; }

 private:
  FrameId frame_;
  VelocityAtFrame measured_;
};

/// Readings since the frame before, brought to the frame by the IMU; of each sensor one factor. One owner.
class VelocityMaker : public FactorMaker {
 public:
  /// `images_show_scale`: not with one camera, whose velocity may be off by a share.
  explicit VelocityMaker(double slip_mps, bool images_show_scale = true)
      : slip_mps_(slip_mps), images_show_scale_(images_show_scale) {}

  std::vector<std::shared_ptr<const Factor>> make(const NewFrame& frame) override;
  HealthReason doubt() const override { return doubt_ ? HealthReason::velocity_disagrees : HealthReason::none; }

 private:
  bool slips(const VelocityAtFrame& measured, const NavState<G>& predicted) const;

  double slip_mps_;
  bool images_show_scale_;
  SensorDoubt doubt_;
};

}  // namespace fbvins
