// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/flight_piece.hpp"

#include <array>
#include <cmath>

#include "fbvins/calibration/flight_points.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/imu/imu_residual.hpp"

namespace fbvins {
namespace {

/// Scale of the Cauchy loss, in standard deviations.
constexpr double kRobust = 2;
/// What a view counts that the lens does not see at all, in standard deviations.
constexpr double kUnseen = 100;
/// Where a piece begins nothing is known: the frame's origin and heading are held loosely, and so are the biases.
constexpr double kPlace_m = 1, kHeading_rad = 0.1, kGyroBias_radps = 0.02, kAccelBias_mps2 = 0.3;
/// Small change of an axis by which its derivatives are taken.
constexpr double kAxisStep = 1e-3;

double loss(double squared) { return 0.5 * kRobust * kRobust * std::log1p(squared / (kRobust * kRobust)); }
double weight(double squared) { return 1 / (1 + squared / (kRobust * kRobust)); }

/// By how much the axes differ from those of a perfect IMU, in the order of flight_parameters().
Eigen::Matrix<double, 15, 1> axes_error(const ImuTriads& axes) {
  Eigen::Matrix<double, 15, 1> out;
  int at = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out[at++] = axes.gyro(i, j) - (i == j ? 1 : 0);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) out[at++] = axes.accel(i, j) - (i == j ? 1 : 0);
  return out;
}

Preintegration integrated(const std::vector<ImuSegment>& segments, const ImuNoise& noise, const ImuBias& bias) {
  Preintegration out(noise, bias);
  for (const ImuSegment& segment : segments) out.integrate(segment);
  return out;
}

/// Row i, column j of a triad, of which readings are freed.
struct Axis {
  bool gyro;
  int i, j;
};
std::vector<Axis> all_axes() {
  std::vector<Axis> out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out.push_back({true, i, j});
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) out.push_back({false, i, j});
  return out;
}

/// How the measured motion changes with the IMU's axes: a reading is axes * (rate or force) + bias.
Eigen::Matrix<double, 9, 15> derivatives_by_axes(const std::vector<ImuSegment>& segments, const ImuNoise& noise,
                                                 const ImuBias& bias) {
  const ImuDeltas at = integrated(segments, noise, bias).deltas();
  Eigen::Matrix<double, 9, 15> out;
  int column = 0;
  for (const Axis& axis : all_axes()) {
    std::vector<ImuSegment> changed = segments;
    for (ImuSegment& segment : changed)
      for (ImuSample& s : segment.samples)
        if (axis.gyro) s.gyro_radps[axis.i] -= kAxisStep * (s.gyro_radps[axis.j] - bias.gyro_radps[axis.j]);
        else s.accel_mps2[axis.i] -= kAxisStep * (s.accel_mps2[axis.j] - bias.accel_mps2[axis.j]);
    const ImuDeltas d = integrated(changed, noise, bias).deltas();
    out.col(column) << d.p - at.p, so3_log(at.q.conjugate() * d.q), d.v - at.v;
    out.col(column++) /= kAxisStep;
  }
  return out;
}

ReadingAt reading_at(const std::vector<FlightKeyframe>& keyframes, std::size_t i) {
  const auto of = [](const ImuSample& s) { return ReadingAt{s.gyro_radps, s.accel_mps2}; };
  if (!keyframes[i].imu.empty() && !keyframes[i].imu.back().empty()) return of(keyframes[i].imu.back().samples.back());
  if (i + 1 < keyframes.size() && !keyframes[i + 1].imu.empty() && !keyframes[i + 1].imu.front().empty())
    return of(keyframes[i + 1].imu.front().samples.front());
  return {};
}

}  // namespace

FlightPiece::FlightPiece(std::vector<FlightKeyframe> keyframes, const ImuNoise& noise, double gravity_mps2,
                         const FlightRig& given)
    : gravity_mps2_(gravity_mps2), given_offset_s_(given.time_offset_s), assumed_(noise), start_(keyframes.front().state) {
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    states_.push_back(keyframes[i].state);
    readings_.push_back(reading_at(keyframes, i));
    if (i == 0) continue;
    const ImuBias& bias = keyframes[i - 1].state.bias;
    steps_.push_back(
        {keyframes[i].imu, integrated(keyframes[i].imu, noise, bias), derivatives_by_axes(keyframes[i].imu, noise, bias)});
  }
  duration_s_ = (keyframes.back().t - keyframes.front().t).seconds();
  for (SeenPoint& point : seen_points(keyframes, given)) {
    Point own{point.p_W, {}};
    for (const SeenPoint::View& view : point.views) own.views.push_back({view.keyframe, view.camera, view.pixel});
    points_.push_back(std::move(own));
  }
}

void FlightPiece::set_noise(const FlightNoise& noise) {
  const bool other_readings = noise.gyro != noise_.gyro || noise.accel != noise_.accel;
  noise_ = noise;
  if (!other_readings) return;
  ImuNoise scaled = assumed_;
  scaled.gyro_noise_density_radps_rthz *= noise.gyro;
  scaled.accel_noise_density_mps2_rthz *= noise.accel;
  for (Step& step : steps_) step.between = integrated(step.segments, scaled, step.between.linearisation_bias());
}

int FlightPiece::views() const {
  int count = 0;
  for (const Point& point : points_) count += static_cast<int>(point.views.size());
  return count;
}

ViewPlace FlightPiece::place(const FlightRig& rig, int keyframe) const {
  const auto k = static_cast<std::size_t>(keyframe);
  return {states_[k], readings_[k], gravity_mps2_, rig.time_offset_s - given_offset_s_};
}

std::vector<double> FlightPiece::residuals_px(const FlightRig& rig) const {
  std::vector<double> out;
  for (const Point& point : points_)
    for (const View& view : point.views)
      if (const auto pixel = view_of(rig, view.camera, place(rig, view.keyframe), point.p_W)) {
        out.push_back(pixel->x() - view.pixel.x());
        out.push_back(pixel->y() - view.pixel.y());
      }
  return out;
}

double FlightPiece::cost(const FlightRig& rig) const {
  double sum = prior_cost();
  const Eigen::Matrix<double, 15, 1> axes = axes_error(rig.axes);
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const Preintegration& between = steps_[i].between;
    Vec15 r = weighted_imu_residual(states_[i], states_[i + 1], between, level_gravity(gravity_mps2_));
    r -= between.sqrt_information().leftCols<9>() * (steps_[i].by_axes * axes);
    sum += 0.5 * r.squaredNorm();
  }
  for (const Point& point : points_)
    for (const View& view : point.views) {
      const auto pixel = view_of(rig, view.camera, place(rig, view.keyframe), point.p_W);
      sum += loss(pixel ? (*pixel - view.pixel).squaredNorm() / (noise_.sigma_px * noise_.sigma_px) : kUnseen * kUnseen);
    }
  return sum;
}

namespace {

/// Residuals of where a piece begins, with the row of its heading by a turn.
struct Beginning {
  Eigen::Matrix<double, 10, 1> residual;
  Eigen::Matrix<double, 10, 15> by_state = Eigen::Matrix<double, 10, 15>::Zero();
};

Beginning beginning(const NavState<W>& now, const NavState<W>& start) {
  Beginning out;
  const Eigen::RowVector3d up_B = now.T_FB.R().row(2);
  const Vec3 turned = so3_log(start.T_FB.q.conjugate() * now.T_FB.q);
  out.residual << (now.T_FB.p - start.T_FB.p) / kPlace_m, up_B.dot(turned) / kHeading_rad,
      (now.bias.gyro_radps - start.bias.gyro_radps) / kGyroBias_radps,
      (now.bias.accel_mps2 - start.bias.accel_mps2) / kAccelBias_mps2;
  out.by_state.block<3, 3>(0, nav::p).diagonal().setConstant(1 / kPlace_m);
  out.by_state.block<1, 3>(3, nav::theta) = up_B / kHeading_rad;
  out.by_state.block<3, 3>(4, nav::bg).diagonal().setConstant(1 / kGyroBias_radps);
  out.by_state.block<3, 3>(7, nav::ba).diagonal().setConstant(1 / kAccelBias_mps2);
  return out;
}

}  // namespace

double FlightPiece::prior_cost() const { return 0.5 * beginning(states_[0], start_).residual.squaredNorm(); }

void FlightPiece::add_prior(double& cost) {
  const Beginning b = beginning(states_[0], start_);
  A_.topLeftCorner<15, 15>() += b.by_state.transpose() * b.by_state;
  gradient_.head<15>() += b.by_state.transpose() * b.residual;
  cost += 0.5 * b.residual.squaredNorm();
}

void FlightPiece::add_steps(const FlightRig& rig, double& cost) {
  const Eigen::Matrix<double, 15, 1> axes = axes_error(rig.axes);
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    Preintegration& between = steps_[i].between;
    if (between.needs_repropagation(states_[i].bias)) between.repropagate(states_[i].bias);
    Mat15 J_i, J_j;
    Vec15 r = weighted_imu_residual(states_[i], states_[i + 1], between, level_gravity(gravity_mps2_), &J_i, &J_j);
    const Eigen::Matrix<double, 15, 15> J_axes = -between.sqrt_information().leftCols<9>() * steps_[i].by_axes;
    r += J_axes * axes;
    Eigen::Matrix<double, 15, 30> J;
    J << J_i, J_j;
    const auto at = static_cast<Eigen::Index>(15 * i);
    A_.block<30, 30>(at, at).noalias() += J.transpose() * J;
    B_.block<30, 15>(at, flight::gyro).noalias() += J.transpose() * J_axes;
    C_.block<15, 15>(flight::gyro, flight::gyro).noalias() += J_axes.transpose() * J_axes;
    gradient_.segment<30>(at) += J.transpose() * r;
    calibration_gradient_.segment<15>(flight::gyro) += J_axes.transpose() * r;
    cost += 0.5 * r.squaredNorm();
  }
}

namespace {

/// Where a view's columns of the calibration go; -1: nowhere.
std::array<int, ViewDerivatives::kColumns> columns_of(const FlightRig& rig, int camera) {
  std::array<int, ViewDerivatives::kColumns> out;
  out.fill(-1);
  for (int i = 0; i <= flight::time_offset; ++i) out[static_cast<std::size_t>(i)] = i;
  int at = flight::first_of(rig, camera);
  for (int i = 0; i < 6 && camera > 0; ++i) out[static_cast<std::size_t>(ViewDerivatives::kPair + i)] = at++;
  const int count = lens_parameter_count(rig.cameras[static_cast<std::size_t>(camera)].model());
  for (int i = 0; i < count; ++i) out[static_cast<std::size_t>(ViewDerivatives::kLens + i)] = at++;
  return out;
}

}  // namespace

void FlightPiece::add_point(const FlightRig& rig, double lambda, std::size_t index, double& cost) {
  Point& point = points_[index];
  PointEquations& e = eliminated_[index];
  e = {};
  e.by_calibration.setZero(3, size_);
  Mat3 H = Mat3::Zero();
  for (const View& view : point.views) {
    ViewDerivatives d;
    const auto pixel = view_of(rig, view.camera, place(rig, view.keyframe), point.p_W, &d);
    if (!pixel) {
      cost += loss(kUnseen * kUnseen);
      continue;
    }
    Vec2 r = (*pixel - view.pixel) / noise_.sigma_px;
    cost += loss(r.squaredNorm());
    const double root = std::sqrt(weight(r.squaredNorm())), scale = root / noise_.sigma_px;
    r *= root;
    d.state *= scale, d.point *= scale, d.calibration *= scale;
    if (e.keyframes.empty() || e.keyframes.back() != view.keyframe) {
      e.keyframes.push_back(view.keyframe);
      e.by_states.push_back(Eigen::Matrix<double, 3, 9>::Zero());
    }
    const Eigen::Index at = 15 * view.keyframe;
    A_.block<9, 9>(at, at).noalias() += d.state.transpose() * d.state;
    gradient_.segment<9>(at) += d.state.transpose() * r;
    H += d.point.transpose() * d.point;
    e.gradient += d.point.transpose() * r;
    e.by_states.back() += d.point.transpose() * d.state;
    add_calibration(columns_[static_cast<std::size_t>(view.camera)], d, r, at, e);
  }
  H.diagonal() *= 1 + lambda;
  H.diagonal().array() += 1e-9;
  e.covariance = H.inverse();
  eliminate(e);
}

void FlightPiece::add_calibration(const Columns& columns, const ViewDerivatives& d, const Vec2& r, Eigen::Index at,
                                  PointEquations& e) {
  const Eigen::Matrix<double, 9, ViewDerivatives::kColumns> B = d.state.transpose() * d.calibration;
  const Eigen::Matrix<double, 3, ViewDerivatives::kColumns> P = d.point.transpose() * d.calibration;
  const Eigen::Matrix<double, ViewDerivatives::kColumns, ViewDerivatives::kColumns> C = d.calibration.transpose() * d.calibration;
  const Eigen::Matrix<double, ViewDerivatives::kColumns, 1> g = d.calibration.transpose() * r;
  for (int i = 0; i < ViewDerivatives::kColumns; ++i) {
    const int to = columns[static_cast<std::size_t>(i)];
    if (to < 0) continue;
    B_.block<9, 1>(at, to) += B.col(i);
    e.by_calibration.col(to) += P.col(i);
    calibration_gradient_[to] += g[i];
    for (int j = 0; j < ViewDerivatives::kColumns; ++j)
      if (const int row = columns[static_cast<std::size_t>(j)]; row >= 0) C_(row, to) += C(j, i);
  }
}

void FlightPiece::eliminate(const PointEquations& e) {
  const Vec3 solved = e.covariance * e.gradient;
  const Eigen::Matrix<double, 3, Eigen::Dynamic> by_calibration = e.covariance * e.by_calibration;
  for (std::size_t i = 0; i < e.keyframes.size(); ++i) {
    const Eigen::Index row = 15 * e.keyframes[i];
    const Eigen::Matrix<double, 9, 3> Y = e.by_states[i].transpose() * e.covariance;
    for (std::size_t j = 0; j < e.keyframes.size(); ++j) A_.block<9, 9>(row, 15 * e.keyframes[j]).noalias() -= Y * e.by_states[j];
    B_.middleRows<9>(row).noalias() -= e.by_states[i].transpose() * by_calibration;
    gradient_.segment<9>(row) -= e.by_states[i].transpose() * solved;
  }
  C_.noalias() -= e.by_calibration.transpose() * by_calibration;
  calibration_gradient_ -= e.by_calibration.transpose() * solved;
}

CalibrationEquations FlightPiece::linearise(const FlightRig& rig, double lambda) {
  size_ = static_cast<int>(values(rig).size());
  const auto n = static_cast<Eigen::Index>(15 * states_.size());
  A_.setZero(n, n), B_.setZero(n, size_), C_.setZero(size_, size_);
  gradient_.setZero(n), calibration_gradient_.setZero(size_);
  eliminated_.resize(points_.size());
  columns_.clear();
  for (int k = 0; k < static_cast<int>(rig.cameras.size()); ++k) columns_.push_back(columns_of(rig, k));
  CalibrationEquations out;
  add_prior(out.cost);
  add_steps(rig, out.cost);
  for (std::size_t i = 0; i < points_.size(); ++i) add_point(rig, lambda, i, out.cost);
  A_.diagonal() *= 1 + lambda;
  A_.diagonal().array() += 1e-9;
  factor_.compute(A_);
  const Eigen::MatrixXd solved = factor_.solve(B_);
  out.information = C_ - B_.transpose() * solved;
  out.information = 0.5 * (out.information + out.information.transpose()).eval();
  out.gradient = calibration_gradient_ - solved.transpose() * gradient_;
  cost_ = out.cost;
  return out;
}

double FlightPiece::unlikelihood() const {
  double sum = cost_;
  for (const Step& step : steps_) sum -= step.between.sqrt_information().diagonal().array().log().sum();
  for (const PointEquations& e : eliminated_) sum -= 0.5 * std::log(e.covariance.determinant());
  return sum + factor_.matrixLLT().diagonal().array().log().sum();
}

void FlightPiece::move(const Eigen::VectorXd& step) {
  states_before_ = states_;
  points_before_.clear();
  const Eigen::VectorXd d = -factor_.solve(gradient_ + B_ * step);
  for (std::size_t i = 0; i < states_.size(); ++i)
    states_[i] = states_[i].boxplus(d.segment<15>(static_cast<Eigen::Index>(15 * i)));
  for (std::size_t i = 0; i < points_.size(); ++i) {
    points_before_.push_back(points_[i].p_W);
    const PointEquations& e = eliminated_[i];
    Vec3 right = e.gradient + e.by_calibration * step;
    for (std::size_t k = 0; k < e.keyframes.size(); ++k) right += e.by_states[k] * d.segment<9>(15 * e.keyframes[k]);
    points_[i].p_W -= e.covariance * right;
  }
}

void FlightPiece::undo() {
  states_ = states_before_;
  for (std::size_t i = 0; i < points_.size(); ++i) points_[i].p_W = points_before_[i];
}

}  // namespace fbvins
