// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_problem.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "fbvins/core/simd.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

/// What an observation without a projection costs: a residual of this many sigmas, with no slope.
constexpr double kUnprojectableSigma = 100.0;
/// Keeps directions without any measurement solvable; far below any real information.
constexpr double kRegularisation = 1e-8;
constexpr double kNegligibleLambda = 1e-8;
/// Damps steps of the inverse depth, 1 m^2. One camera at rest knows next to nothing of it; a free step puts the
/// landmark before the lens, and the whole step is refused for its sake. Moves no optimum and enters no prior.
constexpr double kDepthDamping = 1.0;

/// G += J^T J for two rows of Columns numbers. Full square: plain loops over fixed lanes.
template <int Columns>
inline void add_gram(const double* row0, const double* row1, double* G) {
  for (int i = 0; i < Columns; ++i)
    for (int j = 0; j < Columns; ++j) G[i * Columns + j] += row0[i] * row0[j] + row1[i] * row1[j];
}
FBVINS_KERNEL void add_gram_16(const double* row0, const double* row1, double* G) { add_gram<16>(row0, row1, G); }
FBVINS_KERNEL void add_gram_32(const double* row0, const double* row1, double* G) { add_gram<32>(row0, row1, G); }

}  // namespace

void WindowProblem::prepare_pairs(bool with_first_estimates) {
  const std::size_t n = frames.size();
  pairs_.resize(n * n);
  for (std::size_t h = 0; h < n; ++h) {
    for (std::size_t t = 0; t < n; ++t) {
      PairGeometry& geometry = pairs_[h * n + t];
      geometry.set(frames[h].state.T_WB, frames[t].state.T_WB);
      if (with_first_estimates)
        geometry.set_first(linearisation_point(static_cast<int>(h)).T_WB, linearisation_point(static_cast<int>(t)).T_WB);
    }
  }
}

double WindowProblem::landmark_cost() const {
  const CameraGeometry cameras(calibration);
  double cost = 0;
  for (const WindowLandmark& l : landmarks) {
    const Vec3 x_h = scaled_point_in_host(cameras, l);
    for (int k = 0; k < l.observation_count; ++k) {
      const WindowObservation& o = observations[l.first_observation + k];
      Vec3 p_C;
      Vec2 r;
      const bool ok = reproject(cameras, pair(l.host, o.frame), x_h, l.alpha_beta_rho.z(), o, p_C, r);
      cost += huber(ok ? r.squaredNorm() : kUnprojectableSigma * kUnprojectableSigma, weights.huber_sigma).cost;
    }
    if (l.belief >= 0) cost += belief_cost(cameras, l);
  }
  return cost;
}

template <int Columns>
double WindowProblem::add_landmarks() {
  const CameraGeometry cameras(calibration);
  double cost = 0;
  std::array<double, Columns * Columns> G;
  double rows[2][Columns];
  std::vector<int> offsets;
  for (const WindowLandmark& l : landmarks) {
    const Vec3 x_h = scaled_point_in_host(cameras, l);
    const WindowObservation* begin = observations.data() + l.first_observation;
    const WindowObservation* end = begin + l.observation_count;
    offsets.clear();
    if constexpr (Columns == 32)
      for (int k = 0; k < 3; ++k) offsets.push_back(calibration_row() + 6 * k);
    const int first_pose_block = static_cast<int>(offsets.size());
    bool host_listed = false;
    for (const WindowObservation* o = begin; o != end; ++o) {
      if (!host_listed && o->frame >= l.host) {
        host_listed = true;
        offsets.push_back(pose_row(l.host));
      }
      if (o->frame != l.host && (o == begin || o->frame != o[-1].frame)) offsets.push_back(pose_row(o->frame));
    }
    if (!host_listed) offsets.push_back(pose_row(l.host));
    PointBlock& point = points_.add(offsets);
    const int host_row = pose_row(l.host);
    const auto block_of = [&](int row) {
      return static_cast<int>(std::lower_bound(offsets.begin() + first_pose_block, offsets.end(), row) - offsets.begin());
    };
    const int host_block = block_of(host_row);
    if (l.belief >= 0) cost += add_belief(cameras, l, host_block, point);

    for (const WindowObservation* o = begin; o != end;) {
      const int target = o->frame;
      const bool same = target == l.host;
      G.fill(0);
      for (; o != end && o->frame == target; ++o) {
        Vec3 p_C;
        Vec2 r;
        if (!reproject(cameras, pair(l.host, target), x_h, l.alpha_beta_rho.z(), *o, p_C, r)) {
          cost += huber(kUnprojectableSigma * kUnprojectableSigma, weights.huber_sigma).cost;
          continue;
        }
        const RobustValue robust = huber(r.squaredNorm(), weights.huber_sigma);
        cost += robust.cost;
        fill_jacobian_rows<Columns>(cameras, pair(l.host, target), same, l, x_h, *o, p_C, r, rows);
        if (robust.weight < 1) {
          const double s = std::sqrt(robust.weight);
          for (int k = 0; k < 2; ++k)
            for (double& x : rows[k]) x *= s;
        }
        if constexpr (Columns == 32) add_gram_32(rows[0], rows[1], G.data());
        else add_gram_16(rows[0], rows[1], G.data());
      }

      using Gram = Eigen::Matrix<double, Columns, Columns, Eigen::RowMajor>;
      const Eigen::Map<const Gram> gram(G.data());
      point.V += gram.template block<3, 3>(kPoint, kPoint);
      point.w += gram.template block<3, 1>(kPoint, kResidual);
      if (!same) {
        const int target_row = pose_row(target);
        H_.block<6, 6>(host_row, host_row) += gram.template block<6, 6>(kHost, kHost);
        H_.block<6, 6>(target_row, target_row) += gram.template block<6, 6>(kTarget, kTarget);
        if (target_row > host_row) H_.block<6, 6>(target_row, host_row) += gram.template block<6, 6>(kTarget, kHost);
        else H_.block<6, 6>(host_row, target_row) += gram.template block<6, 6>(kHost, kTarget);
        g_.segment<6>(host_row) += gram.template block<6, 1>(kHost, kResidual);
        g_.segment<6>(target_row) += gram.template block<6, 1>(kTarget, kResidual);
        points_.coupling(point, host_block) += gram.template block<3, 6>(kPoint, kHost);
        points_.coupling(point, block_of(target_row)) += gram.template block<3, 6>(kPoint, kTarget);
      }
      if constexpr (Columns == 32) {
        const int row = calibration_row();
        H_.block<13, 13>(row, row) += gram.template block<13, 13>(kExtrinsic0, kExtrinsic0);
        g_.segment<13>(row) += gram.template block<13, 1>(kExtrinsic0, kResidual);
        if (!same) {
          H_.block<6, 13>(host_row, row) += gram.template block<6, 13>(kHost, kExtrinsic0);
          H_.block<6, 13>(pose_row(target), row) += gram.template block<6, 13>(kTarget, kExtrinsic0);
        }
        for (int k = 0; k < 2; ++k) points_.coupling(point, k) += gram.template block<3, 6>(kPoint, kExtrinsic0 + 6 * k);
        points_.coupling(point, 2).col(0) += gram.template block<3, 1>(kPoint, kTimeOffset);
      }
    }
  }
  return cost;
}

double WindowProblem::add_imu_terms(bool build) {
  const Vec3 gravity_W = tilt.gravity_W(weights.gravity_mps2);
  const Mat32 gravity_by_tilt = tilt.gravity_jacobian(weights.gravity_mps2);
  double cost = 0;
  for (int j = 1; j < static_cast<int>(frames.size()); ++j) {
    const Preintegration* imu = frames[j].imu;
    if (imu == nullptr || imu->empty()) continue;
    const int i = j - 1;
    if (!build) {
      cost += 0.5 * weighted_imu_residual(frames[i].state, frames[j].state, *imu, gravity_W).squaredNorm();
      continue;
    }
    Mat15 J[2];
    const Vec15 r = weighted_imu_residual(frames[i].state, frames[j].state, linearisation_point(i), linearisation_point(j), *imu,
                                          gravity_W, &J[0], &J[1]);
    cost += 0.5 * r.squaredNorm();
    const double dt = imu->dt_s();  // gravity acts as p_j and v_j do, the other way (W15)
    const Eigen::Matrix<double, 15, 2> J_tilt =
        -(0.5 * dt * dt * J[1].middleCols<3>(nav::p) + dt * J[1].middleCols<3>(nav::v)) * gravity_by_tilt;
    if (weights.estimate_tilt) {
      H_.block<2, 2>(tilt_row(), tilt_row()) += J_tilt.transpose() * J_tilt;
      g_.segment<2>(tilt_row()) += J_tilt.transpose() * r;
    }
    const int frame[2] = {i, j};
    for (int a = 0; a < 2; ++a) {
      const Vec15 gradient = J[a].transpose() * r;
      g_.segment<6>(pose_row(frame[a])) += gradient.head<6>();
      g_.segment<9>(speed_bias_row(frame[a])) += gradient.tail<9>();
      if (weights.estimate_tilt) {
        const Eigen::Matrix<double, 15, 2> block = J[a].transpose() * J_tilt;
        H_.block<6, 2>(pose_row(frame[a]), tilt_row()) += block.topRows<6>();
        H_.block<2, 9>(tilt_row(), speed_bias_row(frame[a])) += block.bottomRows<9>().transpose();
      }
      for (int b = 0; b <= a; ++b) {
        const Mat15 block = J[a].transpose() * J[b];
        H_.block<6, 6>(pose_row(frame[a]), pose_row(frame[b])) += block.topLeftCorner<6, 6>();
        H_.block<9, 9>(speed_bias_row(frame[a]), speed_bias_row(frame[b])) += block.bottomRightCorner<9, 9>();
        // Speed and bias rows come before all poses: of the mixed blocks the lower triangle has the pose's rows.
        H_.block<6, 9>(pose_row(frame[a]), speed_bias_row(frame[b])) += block.topRightCorner<6, 9>();
        if (a != b) H_.block<6, 9>(pose_row(frame[b]), speed_bias_row(frame[a])) += block.bottomLeftCorner<9, 6>().transpose();
      }
    }
  }
  return cost;
}

double WindowProblem::add_standstill_terms(bool build) {
  const double information = 1.0 / (weights.standstill_velocity_sigma_mps * weights.standstill_velocity_sigma_mps);
  double cost = 0;
  for (int i = 0; i < static_cast<int>(frames.size()); ++i) {
    if (!frames[i].standstill) continue;
    const Vec3& v = frames[i].state.v_WB;
    cost += 0.5 * information * v.squaredNorm();
    if (!build) continue;
    H_.block<3, 3>(speed_bias_row(i), speed_bias_row(i)).diagonal().array() += information;
    g_.segment<3>(speed_bias_row(i)) += information * v;
  }
  return cost;
}

Eigen::Matrix<double, kCalibrationSize, 1> WindowProblem::calibration_displacement(const Calibration& from) const {
  Eigen::Matrix<double, kCalibrationSize, 1> dx = Eigen::Matrix<double, kCalibrationSize, 1>::Zero();
  dx.segment<3>(0) = calibration.T_BC0.p - from.T_BC0.p;
  dx.segment<3>(3) = so3_log(from.T_BC0.q.conjugate() * calibration.T_BC0.q);
  dx.segment<3>(6) = calibration.T_BC1.p - from.T_BC1.p;
  dx.segment<3>(9) = so3_log(from.T_BC1.q.conjugate() * calibration.T_BC1.q);
  dx(kTimeOffsetIndex) = calibration.time_offset_s - from.time_offset_s;
  return dx;
}

Eigen::VectorXd WindowProblem::prior_displacement() const {
  Eigen::VectorXd dx(prior.quadratic.size());
  if (prior.with_tilt) dx.head<kTiltSize>() = tilt.angle_rad;
  if (prior.with_calibration) dx.segment<kCalibrationSize>(prior.calibration_row()) = calibration_displacement(prior.calibration);
  int at = prior.frames_row();
  for (int frame : prior.frames) {
    dx.segment<15>(at) = frames[frame].state.boxminus(frames[frame].first_estimate);
    at += 15;
  }
  return dx;
}

double WindowProblem::add_prior(bool build) {
  if (prior.empty()) return 0;
  const Eigen::VectorXd dx = prior_displacement();
  if (!build) return prior.quadratic.cost(dx);
  prior_rows_.clear();
  for (int k = 0; prior.with_tilt && k < kTiltSize; ++k) prior_rows_.push_back(tilt_row() + k);
  if (prior.with_calibration)
    for (int k = 0; k < kCalibrationSize; ++k) prior_rows_.push_back(calibration_row() + k);
  for (int frame : prior.frames)
    for (int k = 0; k < 15; ++k) prior_rows_.push_back(row_of(frame, k));
  const Eigen::VectorXd gradient = prior.quadratic.gradient(dx);
  for (int c = 0; c < prior.quadratic.size(); ++c) {
    g_(prior_rows_[c]) += gradient(c);
    for (int r = 0; r < prior.quadratic.size(); ++r)
      if (prior_rows_[r] >= prior_rows_[c]) H_(prior_rows_[r], prior_rows_[c]) += prior.quadratic.H(r, c);
  }
  return 0.5 * dx.dot(gradient + prior.quadratic.g);
}

void WindowProblem::fix_inactive_calibration() {
  // Rows of what is not estimated, and padding: decoupled, unit information, no gradient.
  const int begin = calibration_row();
  for (int k = 0; k < kCalibrationSize; ++k) {
    const bool extrinsic = k < kTimeOffsetIndex;
    const bool active = extrinsic ? weights.estimate_extrinsics : k == kTimeOffsetIndex && weights.estimate_time_offset;
    if (active) continue;
    H_.row(begin + k).setZero();
    H_.col(begin + k).setZero();
    H_(begin + k, begin + k) = 1;
    g_(begin + k) = 0;
    for (PointBlock& point : points_.points()) points_.coupling(point, k / 6).col(k % 6).setZero();
  }
}

double WindowProblem::cost() const {
  WindowProblem& self = const_cast<WindowProblem&>(*this);  // only the cache of pairs changes
  self.prepare_pairs(false);
  return self.add_prior(false) + self.add_imu_terms(false) + self.add_standstill_terms(false) + landmark_cost();
}

double WindowProblem::linearise() {
  const int n = system_size();
  H_.setZero(n, n);
  g_.setZero(n);
  points_.clear();
  prepare_pairs(true);
  double cost = add_prior(true) + add_imu_terms(true) + add_standstill_terms(true);
  cost += calibrating() ? add_landmarks<32>() : add_landmarks<16>();
  if (calibrating()) fix_inactive_calibration();
  return cost;
}

bool WindowProblem::solve(double lambda) {
  factor_lambda_ = lambda;
  reduced_ = H_;
  reduced_g_ = g_;
  reduced_.diagonal() *= 1.0 + lambda;
  reduced_.diagonal().array() += kRegularisation;
  const double depth_damping = lambda > 0 ? kDepthDamping : 0.0;
  if (!points_.eliminate(lambda, reduced_, reduced_g_, depth_damping)) return false;
  llt_.compute(reduced_.selfadjointView<Eigen::Lower>());
  if (llt_.info() != Eigen::Success) return false;
  step_ = -llt_.solve(reduced_g_);
  points_.back_substitute(step_, point_steps_);
  if (!step_.allFinite()) return false;

  // Of the damped quadratic model: (dx^T D dx - g^T dx) / 2.
  double twice = lambda * step_.cwiseAbs2().dot(H_.diagonal()) - g_.dot(step_);
  for (std::size_t i = 0; i < point_steps_.size(); ++i) {
    const PointBlock& point = points_.points()[i];
    twice += lambda * point_steps_[i].cwiseAbs2().dot(point.V.diagonal()) - point.w.dot(point_steps_[i]) +
             depth_damping * point_steps_[i].z() * point_steps_[i].z();
  }
  predicted_decrease_ = 0.5 * twice;
  step_size_ = step_.tail(6 * static_cast<int>(frames.size())).lpNorm<Eigen::Infinity>();
  return true;
}

double WindowProblem::apply_step() {
  saved_states_.resize(frames.size());
  saved_landmarks_.resize(landmarks.size());
  saved_calibration_ = calibration;
  saved_tilt_ = tilt;
  if (weights.estimate_tilt) tilt.angle_rad += step_.segment<kTiltSize>(tilt_row());
  for (int i = 0; i < static_cast<int>(frames.size()); ++i) {
    saved_states_[i] = frames[i].state;
    Vec15 d;
    d << step_.segment<6>(pose_row(i)), step_.segment<9>(speed_bias_row(i));
    frames[i].state = frames[i].state.boxplus(d);
  }
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    saved_landmarks_[i] = landmarks[i].alpha_beta_rho;
    landmarks[i].alpha_beta_rho += point_steps_[i];
    landmarks[i].alpha_beta_rho.z() = std::max(landmarks[i].alpha_beta_rho.z(), weights.min_inverse_depth_1pm);
  }
  if (calibrating()) {
    const auto d = step_.segment<kCalibrationSize>(calibration_row());
    calibration.T_BC0 = calibration.T_BC0.boxplus(d.segment<3>(0), d.segment<3>(3));
    calibration.T_BC1 = calibration.T_BC1.boxplus(d.segment<3>(6), d.segment<3>(9));
    calibration.time_offset_s += d(kTimeOffsetIndex);
  }
  return cost();
}

void WindowProblem::undo_step() {
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i].state = saved_states_[i];
  for (std::size_t i = 0; i < landmarks.size(); ++i) landmarks[i].alpha_beta_rho = saved_landmarks_[i];
  calibration = saved_calibration_;
  tilt = saved_tilt_;
}

LmSummary WindowProblem::optimise(const LmOptions& options) { return minimise(*this, options); }

Vec2 WindowProblem::residual(const WindowLandmark& landmark, const WindowObservation& observation) const {
  const CameraGeometry cameras(calibration);
  PairGeometry geometry;
  geometry.set(frames[landmark.host].state.T_WB, frames[observation.frame].state.T_WB);
  Vec3 p_C;
  Vec2 r;
  if (reproject(cameras, geometry, scaled_point_in_host(cameras, landmark), landmark.alpha_beta_rho.z(), observation, p_C, r))
    return r;
  return Vec2::Constant(std::numeric_limits<double>::infinity());
}

Eigen::MatrixXd WindowProblem::reduced_information() {
  reduced_ = H_;
  reduced_g_ = g_;
  points_.eliminate(0, reduced_, reduced_g_);
  return reduced_.selfadjointView<Eigen::Lower>();
}

bool WindowProblem::covariance(int frame, Mat17& out) {
  if (factor_lambda_ > kNegligibleLambda && !solve(0)) return false;  // damping would feign certainty
  if (llt_.rows() != system_size() || llt_.info() != Eigen::Success) return false;
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(system_size(), 17);
  for (int k = 0; k < 15; ++k) unit(row_of(frame, k), k) = 1;
  for (int k = 0; k < tilt_size(); ++k) unit(tilt_row() + k, 15 + k) = 1;
  llt_.matrixL().solveInPlace(unit);
  out.noalias() = unit.transpose() * unit;
  return out.allFinite();
}

}  // namespace fbvins
