// SPDX-License-Identifier: Apache-2.0
// What the final adjustment minimises beside the edges of graph_costs.hpp: observations of points, and the readings of the IMU
// from keyframe to keyframe (docs/derivations/loop.md, L16, L18). Blocks: pose (p in M, turn about a starting orientation), point
// (in M), motion (v in M, gyroscope bias, accelerometer bias), tilt (a, b: up in M is Exp(a, b, 0) z).
#pragma once

#include <ceres/sized_cost_function.h>

#include <memory>
#include <optional>

#include "fbvins/imu/imu_residual.hpp"
#include "fbvins/loop/graph_costs.hpp"
#include "fbvins/loop/place.hpp"

namespace fbvins {

using PoseBlock = std::array<double, 6>;
using PointBlock = std::array<double, 3>;
using MotionBlock = std::array<double, 9>;
using TiltBlock = std::array<double, 2>;

/// (x, y, inverse depth) of a point in the camera of a keyframe minus those observed, in standard deviations.
class ObservationCost final : public ceres::SizedCostFunction<3, 6, 3> {
 public:
  ObservationCost(const Quat& q_MB, const Pose<B, C0>& T_BC0, const PlaceFeature& seen)
      : q_MB_(q_MB), T_BC0_(T_BC0), seen_(seen) {}
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override;
  /// Nothing for a point behind the camera.
  std::optional<Vec3> residual(const PoseBlock& pose, const PointBlock& point) const;

 private:
  Quat q_MB_;
  Pose<B, C0> T_BC0_;
  PlaceFeature seen_;
};

/// The readings between two keyframes: blocks pose, motion, pose, motion, tilt.
class ImuCost final : public ceres::SizedCostFunction<15, 6, 9, 6, 9, 2> {
 public:
  ImuCost(const Quat& q_Mi, const Quat& q_Mj, std::shared_ptr<const Preintegration> between, double gravity_mps2)
      : q_Mi_(q_Mi), q_Mj_(q_Mj), between_(std::move(between)), gravity_mps2_(gravity_mps2) {}
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override;

 private:
  Quat q_Mi_, q_Mj_;
  std::shared_ptr<const Preintegration> between_;
  double gravity_mps2_;
};

/// The quaternion that takes directions of a gravity-aligned frame to M.
Quat turn_of(const TiltBlock& tilt);

}  // namespace fbvins
