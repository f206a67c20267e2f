// SPDX-License-Identifier: Apache-2.0
// Places that a frame of a depth sensor sees on the surfaces of an earlier one (docs/derivations/surfaces.md, D4, D5).
#pragma once

#include <memory>
#include <vector>

#include "fbvins/estimator/factor.hpp"

namespace fbvins {

/// A place that a frame sees on a surface of an earlier one.
struct SurfaceDistance {
  Vec3 p_B;                ///< in the body of the frame, m
  Vec3 normal_B, on_it_B;  ///< of the surface, and a point of it, in the body of the earlier frame
  double inverse_sigma_1pm = 0;
};

class SurfaceFactor : public Factor {
 public:
  /// `reference`: the earlier frame.
  SurfaceFactor(FrameId frame, FrameId reference, std::vector<SurfaceDistance> distances)
      : frame_(frame), reference_(reference), distances_(std::move(distances)) {}

  std::string_view name() const override { return "surfaces"; }
  std::vector<Variable> variables() const override { return {Variable::pose_of(frame_), Variable::pose_of(reference_)}; }
  double cost(const WindowProblem& window) const override;
  double linearise(const WindowProblem& window, NormalEquations& out) const override;
  /// The successor has surfaces of its own.
  std::shared_ptr<const Factor> without(const DroppedFrame&) const override { return nullptr; }

  FrameId frame() const { return frame_; }
  FrameId reference() const { return reference_; }
  const std::vector<SurfaceDistance>& distances() const { return distances_; }

 private:
  FrameId frame_, reference_;
  std::vector<SurfaceDistance> distances_;
};

}  // namespace fbvins
