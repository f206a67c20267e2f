// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/surface_factor.hpp"

#include "fbvins/estimator/window_equations.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

double distance_in_sigmas(const SurfaceDistance& d, const Pose<B, B>& T_rn) {
  return d.inverse_sigma_1pm * d.normal_B.dot(T_rn * d.p_B - d.on_it_B);
}

}  // namespace

double SurfaceFactor::cost(const WindowProblem& w) const {
  const Pose<B, B> T_rn = w.frame(reference_).state.T_FB.inverse() * w.frame(frame_).state.T_FB;
  double cost = 0;
  for (const SurfaceDistance& d : distances_) {
    const double r = distance_in_sigmas(d, T_rn);
    cost += huber(r * r, w.weights.huber_sigma).cost;
  }
  return cost;
}

double SurfaceFactor::linearise(const WindowProblem& w, NormalEquations& out) const {
  using Vec12 = Eigen::Matrix<double, 12, 1>;
  const int i = w.index_of(frame_), of = w.index_of(reference_);
  const Pose<B, B> T_rn = w.frames[of].state.T_FB.inverse() * w.frames[i].state.T_FB;
  const Pose<G, B> first_n = w.linearisation_point(i).T_FB, first_r = w.linearisation_point(of).T_FB;
  const Pose<B, B> first_rn = first_r.inverse() * first_n;
  const Mat3 R_r = first_r.R(), R_nr = first_rn.R().transpose();
  double cost = 0;
  Eigen::Matrix<double, 12, 12> H = Eigen::Matrix<double, 12, 12>::Zero();  // of the frame, of its reference
  Vec12 g = Vec12::Zero();
  for (const SurfaceDistance& d : distances_) {
    const double r = distance_in_sigmas(d, T_rn);
    const RobustValue robust = huber(r * r, w.weights.huber_sigma);
    cost += robust.cost;
    const Vec3 along_G = R_r * d.normal_B;
    Vec12 J;
    J << along_G, d.p_B.cross(R_nr * d.normal_B), -along_G, d.normal_B.cross(first_rn * d.p_B);
    J *= d.inverse_sigma_1pm;
    H.noalias() += robust.weight * J * J.transpose();
    g += robust.weight * r * J;
  }
  const int newest = out.layout.pose_row(i), reference = out.layout.pose_row(of);
  out.H.block<6, 6>(newest, newest) += H.topLeftCorner<6, 6>();
  out.H.block<6, 6>(reference, reference) += H.bottomRightCorner<6, 6>();
  out.H.block<6, 6>(newest, reference) += H.topRightCorner<6, 6>();  // the reference is the earlier one
  out.g.segment<6>(newest) += g.head<6>();
  out.g.segment<6>(reference) += g.tail<6>();
  return cost;
}

}  // namespace fbvins
