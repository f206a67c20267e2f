// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/height_factor.hpp"

#include "fbvins/core/hypotenuse.hpp"
#include "fbvins/estimator/window_equations.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

/// What handing it on to the next frame adds.
constexpr double kHandedOn_m = 0.002;

Vec3 up_G(const Tilt& tilt) { return tilt.gravity_G(-1); }

}  // namespace

double HeightFactor::residual(const WindowProblem& w) const {
  const double height_m = up_G(w.tilt).dot(w.frame(frame_).state.T_FB * point_B_);
  return (height_m - w.own_variable(level_).value(0) - above_m_) / sigma_m_;
}

double HeightFactor::cost(const WindowProblem& w) const {
  const double r = residual(w);
  return huber(r * r, w.weights.huber_sigma).cost;
}

double HeightFactor::linearise(const WindowProblem& w, NormalEquations& out) const {
  const double r = residual(w);
  const RobustValue robust = huber(r * r, w.weights.huber_sigma);
  const int i = w.index_of(frame_);
  const Pose<G, B> T_GB = w.linearisation_point(i).T_FB;
  const Vec3 up = up_G(w.tilt);
  Vec6 J_pose;
  J_pose << up, point_B_.cross(T_GB.q.conjugate() * up);
  J_pose /= sigma_m_;
  const Vec2 J_tilt = w.tilt.gravity_jacobian(-1).transpose() * (T_GB * point_B_) / sigma_m_;
  const double J_level = -1 / sigma_m_;

  const int pose = out.layout.pose_row(i), tilt = out.layout.tilt_row();
  const int level = row_of(w, out.layout, Variable::own_one(level_));
  const double weight = robust.weight;
  out.g.segment<6>(pose) += weight * r * J_pose;
  out.g(level) += weight * r * J_level;
  out.H.block<6, 6>(pose, pose) += weight * J_pose * J_pose.transpose();
  out.H.block<6, 1>(pose, level) += weight * J_level * J_pose;
  out.H(level, level) += weight * J_level * J_level;
  if (out.layout.tilt_size > 0) {
    out.g.segment<2>(tilt) += weight * r * J_tilt;
    out.H.block<2, 2>(tilt, tilt) += weight * J_tilt * J_tilt.transpose();
    out.H.block<1, 2>(level, tilt) += weight * J_level * J_tilt.transpose();
    out.H.block<6, 2>(pose, tilt) += weight * J_pose * J_tilt.transpose();
  }
  return robust.cost;
}

std::shared_ptr<const Factor> HeightFactor::without(const DroppedFrame& d) const {
  return std::make_shared<const HeightFactor>(d.successor, level_, d.T_successor_dropped * point_B_,
                                              hypotenuse(sigma_m_, kHandedOn_m), above_m_);
}

}  // namespace fbvins
