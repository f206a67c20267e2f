// SPDX-License-Identifier: Apache-2.0
// The scale of one camera by a rangefinder: landmarks that lie on the floor are so far below the body as the images say, and the
// floor is as far as the beam says (docs/derivations/aiding.md, R4-R6).
#pragma once

#include <optional>
#include <vector>

#include "fbvins/estimator/factor_maker.hpp"

namespace fbvins {

/// How many times as far below the body as it is the floor's landmarks are, and the standard deviation of that.
struct FloorScale {
  double ratio = 1, sigma = 0;
};

/// `drop_m`: how far below the body the floor is. `landmarks`: in G. None where no flat group of them can be the floor.
std::optional<FloorScale> floor_scale(const std::vector<Vec3>& landmarks_G, const Vec3& p_G, const Vec3& up_G, double drop_m);

/// Two keyframes are so far apart.
class DistanceFactor : public Factor {
 public:
  DistanceFactor(FrameId from, FrameId to, double distance_m, double sigma_m)
      : from_(from), to_(to), distance_m_(distance_m), sigma_m_(sigma_m) {}

  std::string_view name() const override { return "distance"; }
  std::vector<Variable> variables() const override { return {Variable::pose_of(from_), Variable::pose_of(to_)}; }
  double cost(const WindowProblem& window) const override;
  double linearise(const WindowProblem& window, NormalEquations& out) const override;
  /// Keyframes are marginalised; one that is dropped all the same takes its distance with it.
  std::shared_ptr<const Factor> without(const DroppedFrame&) const override { return nullptr; }

  double distance_m() const { return distance_m_; }

 private:
  FrameId from_, to_;  ///< the earlier one first
  double distance_m_, sigma_m_;
};

/// Between the oldest and the newest keyframe of the window, by what the beam of the newest frame says; null where that says
/// nothing.
std::shared_ptr<const Factor> distance_by_floor(const NewFrame& frame, double drop_m);

}  // namespace fbvins
