// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_equations.hpp"

#include "fbvins/imu/imu_residual.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

/// Relative damping with which a landmark is eliminated whose depth the observations leave open.
constexpr double kDampingOfSingular = 1e-5;

// Each term returns its cost, and adds to the equations unless they are null.

double prior_term(const WindowProblem& w, NormalEquations* out) {
  const WindowPrior& prior = w.prior;
  if (prior.empty()) return 0;
  const Eigen::VectorXd dx = w.prior_displacement();
  if (out == nullptr) return prior.quadratic.cost(dx);
  const WindowLayout& at = out->layout;
  std::vector<int> rows;
  rows.reserve(static_cast<std::size_t>(prior.quadratic.size()));
  for (int k = 0; prior.with_tilt && k < kTiltSize; ++k) rows.push_back(at.tilt_row() + k);
  if (prior.with_calibration)
    for (int k = 0; k < kCalibrationSize; ++k) rows.push_back(at.calibration_row() + k);
  for (int frame : prior.frames)
    for (int k = 0; k < 15; ++k) rows.push_back(at.row_of(frame, k));
  const Eigen::VectorXd gradient = prior.quadratic.gradient(dx);
  for (int c = 0; c < prior.quadratic.size(); ++c) {
    out->g(rows[c]) += gradient(c);
    for (int r = 0; r < prior.quadratic.size(); ++r)
      if (rows[r] >= rows[c]) out->H(rows[r], rows[c]) += prior.quadratic.H(r, c);
  }
  return 0.5 * dx.dot(gradient + prior.quadratic.g);
}

/// Adds one IMU term's blocks, between the frame before `j` and `j`.
void add_imu_blocks(int j, const Mat15 (&J)[2], const Eigen::Matrix<double, 15, 2>& J_tilt, const Vec15& r,
                    NormalEquations& out) {
  const WindowLayout& at = out.layout;
  Eigen::MatrixXd& H = out.H;
  Eigen::VectorXd& g = out.g;
  const bool with_tilt = at.tilt_size > 0;
  if (with_tilt) {
    H.block<2, 2>(at.tilt_row(), at.tilt_row()) += J_tilt.transpose() * J_tilt;
    g.segment<2>(at.tilt_row()) += J_tilt.transpose() * r;
  }
  const int pose[2] = {at.pose_row(j - 1), at.pose_row(j)}, speed[2] = {at.speed_bias_row(j - 1), at.speed_bias_row(j)};
  for (int a = 0; a < 2; ++a) {
    const Vec15 gradient = J[a].transpose() * r;
    g.segment<6>(pose[a]) += gradient.head<6>();
    g.segment<9>(speed[a]) += gradient.tail<9>();
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

double imu_terms(const WindowProblem& w, NormalEquations* out) {
  const Vec3 gravity_G = w.tilt.gravity_G(w.weights.gravity_mps2);
  const Mat32 gravity_by_tilt = w.tilt.gravity_jacobian(w.weights.gravity_mps2);
  double cost = 0;
  for (int j = 1; j < w.frame_count(); ++j) {
    const Preintegration* imu = w.frames[j].imu.get();
    if (imu == nullptr || imu->empty()) continue;
    const int i = j - 1;
    if (out == nullptr) {
      cost += 0.5 * weighted_imu_residual(w.frames[i].state, w.frames[j].state, *imu, gravity_G).squaredNorm();
      continue;
    }
    Mat15 J[2];
    const Vec15 r = weighted_imu_residual(w.frames[i].state, w.frames[j].state, w.linearisation_point(i),
                                          w.linearisation_point(j), *imu, gravity_G, &J[0], &J[1]);
    cost += 0.5 * r.squaredNorm();
    const double dt = imu->dt_s();  // the derivatives by gravity are those by p_j and v_j, scaled and negated (W15)
    const Eigen::Matrix<double, 15, 2> J_tilt =
        -(0.5 * dt * dt * J[1].middleCols<3>(nav::p) + dt * J[1].middleCols<3>(nav::v)) * gravity_by_tilt;
    add_imu_blocks(j, J, J_tilt, r, *out);
  }
  return cost;
}

double standstill_terms(const WindowProblem& w, NormalEquations* out) {
  const double sigma = w.weights.standstill_velocity_sigma_mps, information = 1.0 / (sigma * sigma);
  double cost = 0;
  for (int i = 0; i < w.frame_count(); ++i) {
    if (!w.frames[i].standstill) continue;
    const Vec3& v = w.frames[i].state.v_FB;
    cost += 0.5 * information * v.squaredNorm();
    if (out == nullptr) continue;
    const int row = out->layout.speed_bias_row(i);
    out->H.block<3, 3>(row, row).diagonal().array() += information;
    out->g.segment<3>(row) += information * v;
  }
  return cost;
}

/// (D4), (D5): of frame `i` to its reference.
double surface_term(const WindowProblem& w, int i, NormalEquations* out) {
  using Vec12 = Eigen::Matrix<double, 12, 1>;
  const WindowFrame& f = w.frames[i];
  const Pose<G, B>&T_n = f.state.T_FB, &T_r = w.frames[f.surfaces_of].state.T_FB;
  const Pose<B, B> T_rn = T_r.inverse() * T_n;
  const Pose<G, B> first_n = w.linearisation_point(i).T_FB, first_r = w.linearisation_point(f.surfaces_of).T_FB;
  const Pose<B, B> first_rn = first_r.inverse() * first_n;
  const Mat3 R_r = first_r.R(), R_nr = first_rn.R().transpose();
  double cost = 0;
  Eigen::Matrix<double, 12, 12> H = Eigen::Matrix<double, 12, 12>::Zero();  // of the frame, of its reference
  Vec12 g = Vec12::Zero();
  for (const SurfaceDistance& d : f.surfaces->distances) {
    const double r = d.inverse_sigma_1pm * d.normal_B.dot(T_rn * d.p_B - d.on_it_B);
    const RobustValue robust = huber(r * r, w.weights.huber_sigma);
    cost += robust.cost;
    if (out == nullptr) continue;
    const Vec3 along_G = R_r * d.normal_B;
    Vec12 J;
    J << along_G, d.p_B.cross(R_nr * d.normal_B), -along_G, d.normal_B.cross(first_rn * d.p_B);
    J *= d.inverse_sigma_1pm;
    H.noalias() += robust.weight * J * J.transpose();
    g += robust.weight * r * J;
  }
  if (out == nullptr) return cost;
  const int newest = out->layout.pose_row(i), reference = out->layout.pose_row(f.surfaces_of);
  out->H.block<6, 6>(newest, newest) += H.topLeftCorner<6, 6>();
  out->H.block<6, 6>(reference, reference) += H.bottomRightCorner<6, 6>();
  out->H.block<6, 6>(newest, reference) += H.topRightCorner<6, 6>();  // the reference is the earlier one
  out->g.segment<6>(newest) += g.head<6>();
  out->g.segment<6>(reference) += g.tail<6>();
  return cost;
}

double surface_terms(const WindowProblem& w, NormalEquations* out) {
  double cost = 0;
  for (int i = 0; i < w.frame_count(); ++i)
    if (w.frames[i].surfaces) cost += surface_term(w, i, out);
  return cost;
}

/// Rows of calibration that is not estimated, and of padding: decoupled, unit information, no gradient.
void fix_inactive_calibration(const WindowWeights& weights, NormalEquations& out) {
  const int begin = out.layout.calibration_row();
  for (int k = 0; k < kCalibrationSize; ++k) {
    if (k < kTimeOffsetIndex
            ? weights.estimate_extrinsics
            : (k == kTimeOffsetIndex && weights.estimate_time_offset) || (k == kLineDelayIndex && weights.estimate_line_delay))
      continue;
    out.H.row(begin + k).setZero();
    out.H.col(begin + k).setZero();
    out.H(begin + k, begin + k) = 1;
    out.g(begin + k) = 0;
    for (PointBlock& point : out.points.points()) out.points.coupling(point, k / 6).col(k % 6).setZero();
  }
}

}  // namespace

void PairTable::fill(const WindowProblem& window, bool with_first_estimates) {
  n_ = window.frames.size();
  pairs_.resize(n_ * n_);
  for (std::size_t h = 0; h < n_; ++h) {
    for (std::size_t t = 0; t < n_; ++t) {
      PairGeometry& geometry = pairs_[h * n_ + t];
      geometry.set(window.frames[h].state.T_FB, window.frames[t].state.T_FB);
      if (with_first_estimates)
        geometry.set_first(window.linearisation_point(static_cast<int>(h)).T_FB,
                           window.linearisation_point(static_cast<int>(t)).T_FB);
    }
  }
}

double cost_of(const WindowProblem& window, PairTable& pairs) {
  pairs.fill(window, false);
  return prior_term(window, nullptr) + imu_terms(window, nullptr) + standstill_terms(window, nullptr) +
         surface_terms(window, nullptr) + landmark_cost(window, pairs);
}

double linearise(const WindowProblem& window, PairTable& pairs, NormalEquations& out) {
  out.layout = WindowLayout(window);
  const int n = out.layout.size();
  out.H.setZero(n, n);
  out.g.setZero(n);
  out.points.clear();
  pairs.fill(window, true);
  double cost = prior_term(window, &out);
  cost += imu_terms(window, &out);
  cost += standstill_terms(window, &out);
  cost += surface_terms(window, &out);
  cost += add_landmarks(window, pairs, out);
  if (window.calibrating()) fix_inactive_calibration(window.weights, out);
  return cost;
}

ReducedEquations reduced(NormalEquations& equations) {
  ReducedEquations out{equations.H, equations.g};
  if (!equations.points.eliminate(0, out.H, out.g)) {
    out = {equations.H, equations.g};
    equations.points.eliminate(kDampingOfSingular, out.H, out.g);
  }
  out.H = Eigen::MatrixXd(out.H.selfadjointView<Eigen::Lower>());
  return out;
}

}  // namespace fbvins
