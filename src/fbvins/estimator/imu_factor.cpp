// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/imu_factor.hpp"

#include "fbvins/estimator/window_equations.hpp"
#include "fbvins/imu/imu_residual.hpp"

namespace fbvins {
namespace {

/// Adds the blocks of the readings between frames `i` and `j`.
void add_imu_blocks(int i, int j, const Mat15 (&J)[2], const Eigen::Matrix<double, 15, 2>& J_tilt, const Vec15& r,
                    NormalEquations& out) {
  const WindowLayout& at = out.layout;
  Eigen::MatrixXd& H = out.H;
  Eigen::VectorXd& g = out.g;
  const bool with_tilt = at.tilt_size > 0;
  if (with_tilt) {
    H.block<2, 2>(at.tilt_row(), at.tilt_row()) += J_tilt.transpose() * J_tilt;
    g.segment<2>(at.tilt_row()) += J_tilt.transpose() * r;
  }
  const int pose[2] = {at.pose_row(i), at.pose_row(j)}, speed[2] = {at.speed_bias_row(i), at.speed_bias_row(j)};
  for (int a = 0; a < 2; ++a) {
    const Vec15 gradient = J[a].transpose() * r;
    g.segment<6>(pose[a]) += gradient.head<6>();
    g.segment<9>(speed[a]) += gradient.tail<9>();
    if (out.gradient_alone) continue;
    if (with_tilt) {
      const Eigen::Matrix<double, 15, 2> block = J[a].transpose() * J_tilt;
      H.block<6, 2>(pose[a], at.tilt_row()) += block.topRows<6>();
      H.block<2, 9>(at.tilt_row(), speed[a]) += block.bottomRows<9>().transpose();
    }
    for (int b = 0; b <= a; ++b) {
      const Mat15 block = J[a].transpose() * J[b];
      H.block<6, 6>(pose[a], pose[b]) += block.topLeftCorner<6, 6>();
      H.block<9, 9>(speed[a], speed[b]) += block.bottomRightCorner<9, 9>();
      // Velocity and bias rows come before all poses: mixed blocks in the lower triangle have the rows of a pose.
      H.block<6, 9>(pose[a], speed[b]) += block.topRightCorner<6, 9>();
      if (a != b) H.block<6, 9>(pose[b], speed[a]) += block.bottomLeftCorner<9, 6>().transpose();
    }
  }
}

}  // namespace

double ImuFactor::cost(const WindowProblem& w) const {
  const Vec3 gravity_G = w.tilt.gravity_G(w.weights.gravity_mps2);
  return 0.5 * weighted_imu_residual(w.frame(from_).state, w.frame(to_).state, *readings_, gravity_G).squaredNorm();
}

double ImuFactor::linearise(const WindowProblem& w, NormalEquations& out) const {
  const int i = w.index_of(from_), j = w.index_of(to_);
  Mat15 J[2];
  const Vec15 r = weighted_imu_residual(w.frames[i].state, w.frames[j].state, w.linearisation_point(i), w.linearisation_point(j),
                                        *readings_, w.tilt.gravity_G(w.weights.gravity_mps2), &J[0], &J[1]);
  const double dt = readings_->dt_s();  // the derivatives by gravity are those by p_j and v_j, scaled and negated (W15)
  const Eigen::Matrix<double, 15, 2> J_tilt = -(0.5 * dt * dt * J[1].middleCols<3>(nav::p) + dt * J[1].middleCols<3>(nav::v)) *
                                              w.tilt.gravity_jacobian(w.weights.gravity_mps2);
  add_imu_blocks(i, j, J, J_tilt, r, out);
  return 0.5 * r.squaredNorm();
}

}  // namespace fbvins
