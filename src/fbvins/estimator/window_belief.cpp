// SPDX-License-Identifier: Apache-2.0
// The window problem, part two: landmarks that were known before.
#include "fbvins/estimator/window_problem.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {

Vec3 WindowProblem::distance_to_belief(const WindowLandmark& l) const {
  return belief_residual(CameraGeometry(calibration), frames[l.host].state.T_WB, l, beliefs[l.belief]);
}

double WindowProblem::belief_cost(const CameraGeometry& cameras, const WindowLandmark& l) const {
  const Vec3 r = belief_residual(cameras, frames[l.host].state.T_WB, l, beliefs[l.belief]);
  return huber(r.squaredNorm(), weights.huber_sigma).cost;
}

double WindowProblem::add_belief(const CameraGeometry& cameras, const WindowLandmark& l, int host_block, PointBlock& point) {
  const LandmarkBelief& belief = beliefs[l.belief];
  const Vec3 r = belief_residual(cameras, frames[l.host].state.T_WB, l, belief);
  const RobustValue robust = huber(r.squaredNorm(), weights.huber_sigma);
  const BeliefJacobian J(cameras, linearisation_point(l.host).T_WB, l, belief);
  const int host = pose_row(l.host);
  H_.block<6, 6>(host, host) += robust.weight * J.host.transpose() * J.host;
  g_.segment<6>(host) += robust.weight * J.host.transpose() * r;
  point.V += robust.weight * J.point.transpose() * J.point;
  point.w += robust.weight * J.point.transpose() * r;
  points_.coupling(point, host_block) += robust.weight * J.point.transpose() * J.host;
  if (calibrating()) {
    const int row = calibration_row();
    H_.block<6, 6>(row, row) += robust.weight * J.extrinsic.transpose() * J.extrinsic;
    H_.block<6, 6>(host, row) += robust.weight * J.host.transpose() * J.extrinsic;
    g_.segment<6>(row) += robust.weight * J.extrinsic.transpose() * r;
    points_.coupling(point, 0) += robust.weight * J.point.transpose() * J.extrinsic;
  }
  return robust.cost;
}

}  // namespace fbvins
