// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera_problem.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace fbvins {
namespace {

// Where there are neither readings nor images, the path is as straight as these allow (C9). Where there are, they say nothing: a
// reading is worth ten thousand times as much.
constexpr double kSmoothAccel_mps2 = 100, kSmoothTurn_radps2 = 300;
// What a sensor's bias may be.
constexpr double kGyroBias_radps = 1, kAccelBias_mps2 = 1;

Vec6 stacked(const ImuBias& bias) {
  Vec6 out;
  out << bias.gyro_radps, bias.accel_mps2;
  return out;
}

}  // namespace

ImuBias CalibrationState::bias_at(double t_s) const {
  const int node = path.interval(t_s) / intervals_per_bias;
  const double part = (t_s / path.spacing_s() - node * intervals_per_bias) / intervals_per_bias;
  const ImuBias &a = biases[static_cast<std::size_t>(node)], &b = biases[static_cast<std::size_t>(node) + 1];
  return {Vec3(a.gyro_radps + part * (b.gyro_radps - a.gyro_radps)), Vec3(a.accel_mps2 + part * (b.accel_mps2 - a.accel_mps2))};
}

ImuCameraProblem::ImuCameraProblem(CalibrationData data, CalibrationState state, CalibrationSetup setup)
    : data_(std::move(data)), state_(std::move(state)), before_(state_), setup_(std::move(setup)) {
  state_.later_s.resize(data_.cameras.size(), 0.0);
  lay_out();
}

void ImuCameraProblem::change(const CalibrationSetup& setup) {
  setup_ = setup;
  lay_out();
}

void ImuCameraProblem::lay_out() {
  const int knots = state_.path.size(), nodes = static_cast<int>(state_.biases.size());
  const int reach = state_.intervals_per_bias;
  knot_index_.assign(static_cast<std::size_t>(knots), 0);
  bias_index_.assign(static_cast<std::size_t>(nodes), 0);
  std::vector<int> first;
  int node = 0;
  for (int k = 0; k < knots; ++k) {
    knot_index_[static_cast<std::size_t>(k)] = static_cast<int>(first.size());
    const int coupled = knot_index(std::max(0, k - kSplineOrder + 1));
    first.insert(first.end(), 6, coupled);
    // A node follows the last knot that shares a reading with it, so that no knot's row becomes longer.
    for (; node < nodes && (k == knots - 1 || k == (node + 1) * reach + kSplineOrder - 2); ++node) {
      bias_index_[static_cast<std::size_t>(node)] = static_cast<int>(first.size());
      int begin = knot_index(std::min(k, std::max(0, (node - 1) * reach)));
      if (node > 0) begin = std::min(begin, bias_index_[static_cast<std::size_t>(node - 1)]);
      first.insert(first.end(), 6, begin);
    }
  }
  layout_ = {};
  layout_.begin = layout_.end = static_cast<int>(first.size());
  const auto take = [&](int count) { return std::exchange(layout_.end, layout_.end + count); };
  for (std::size_t c = 0; c < data_.cameras.size(); ++c) layout_.cameras.push_back(take(6));
  layout_.time_offset = take(1);
  layout_.gravity = take(3);
  if (setup_.free_board_scale) layout_.board_scale = take(1);
  if (setup_.free_line_delay) layout_.line_delay = take(1);
  if (setup_.free_camera_offsets && data_.cameras.size() > 1) layout_.later = take(static_cast<int>(data_.cameras.size()) - 1);
  if (setup_.free_axes) layout_.axes = take(15);
  first.resize(static_cast<std::size_t>(layout_.end), 0);
  system_.emplace(std::move(first));
}

double ImuCameraProblem::linearise() {
  system_->set_zero();
  return evaluate(true);
}

double ImuCameraProblem::evaluate(bool build) {
  double cost = add_smoothness(build) + add_bias_walk(build) + add_priors(build) + add_images(build);
  for (const CalibrationReading& reading : data_.readings)
    if (reading.used) cost += add_reading(reading, build);
  return cost;
}

double ImuCameraProblem::add_images(bool build) {
  double cost = 0;
  for (const CalibrationView& view : data_.views) cost += add_view(view, build);
  for (std::size_t c = 1; c < setup_.T_CnC0.size(); ++c) cost += add_camera_prior(c, build);
  return cost;
}

double ImuCameraProblem::add_rows(bool build) {
  if (build) {
    const auto J = J_.leftCols(static_cast<Eigen::Index>(index_.size()));
    system_->add(index_, J.transpose() * J, J.transpose() * r_);
  }
  return 0.5 * r_.squaredNorm();
}

double ImuCameraProblem::add_smoothness(bool build) {
  const double spacing2 = state_.path.spacing_s() * state_.path.spacing_s();
  const double turn = 1 / (spacing2 * kSmoothTurn_radps2), bend = 1 / (spacing2 * kSmoothAccel_mps2);
  double cost = 0;
  for (int k = 0; k + 2 < state_.path.size(); ++k) {
    r_.resize(6);
    r_ << turn * (state_.path.turn(k + 1) - state_.path.turn(k)),
        bend * (state_.path.knot(k).p - 2 * state_.path.knot(k + 1).p + state_.path.knot(k + 2).p);
    if (build) {
      const Mat3 &own = state_.path.turn_jacobian(k), &next = state_.path.turn_jacobian(k + 1);
      index_.clear();
      J_.setZero(6, 96);
      for (int i = 0; i < 3; ++i) columns(knot_index(k + i), 6);
      J_.block<3, 3>(0, 0) = turn * own.transpose();
      J_.block<3, 3>(0, 6) = -turn * (own + next.transpose());
      J_.block<3, 3>(0, 12) = turn * next;
      for (int i = 0; i < 3; ++i) J_.block<3, 3>(3, 6 * i + 3).diagonal().setConstant(i == 1 ? -2 * bend : bend);
    }
    cost += add_rows(build);
  }
  return cost;
}

double ImuCameraProblem::add_bias_walk(bool build) {
  const double span_s = state_.intervals_per_bias * state_.path.spacing_s();
  Vec6 weight, first;
  weight << Vec3::Constant(1 / (setup_.gyro_walk_radps2_rthz * std::sqrt(span_s))),
      Vec3::Constant(1 / (setup_.accel_walk_mps3_rthz * std::sqrt(span_s)));
  first << Vec3::Constant(1 / kGyroBias_radps), Vec3::Constant(1 / kAccelBias_mps2);
  double cost = 0;
  for (std::size_t n = 0; n < state_.biases.size(); ++n) {  // (C8)
    const Vec6& w = n == 0 ? first : weight;
    r_ = w.cwiseProduct(stacked(state_.biases[n]));
    if (n > 0) r_ -= w.cwiseProduct(stacked(state_.biases[n - 1]));
    if (build) {
      index_.clear();
      J_.setZero(6, 96);
      J_.block<6, 6>(0, columns(bias_index_[n], 6)).diagonal() = w;
      if (n > 0) J_.block<6, 6>(0, columns(bias_index_[n - 1], 6)).diagonal() = -w;
    }
    cost += add_rows(build);
  }
  return cost;
}

double ImuCameraProblem::add_priors(bool build) {
  double cost = 0;
  const double gravity = state_.gravity_T.norm();
  r_.resize(1);
  r_(0) = (gravity - setup_.gravity_mps2) / setup_.gravity_sigma_mps2;
  if (build) {
    index_.clear();
    J_.setZero(1, 96);
    J_.block<1, 3>(0, columns(layout_.gravity, 3)) = state_.gravity_T.transpose() / (gravity * setup_.gravity_sigma_mps2);
  }
  return cost + add_rows(build);
}

double ImuCameraProblem::add_camera_prior(std::size_t camera, bool build) {
  const Pose<B, Cn>&own = state_.T_BC[camera], &first = state_.T_BC[0];
  const Pose<C0, Cn> given = setup_.T_CnC0[camera].inverse();
  const Mat3 R_C0B = first.R().transpose();
  const Pose<C0, Cn> now(Quat(first.q.conjugate() * own.q), R_C0B * (own.p - first.p));
  const double wp = 1 / setup_.camera_sigma_m, wt = 1 / setup_.camera_sigma_rad;
  const Vec3 turn = so3_log(given.q.conjugate() * now.q);
  r_.resize(6);
  r_ << wp * (now.p - given.p), wt * turn;
  if (build) {  // (C10)
    const Mat3 inverse = wt * so3_right_jacobian_inverse(turn);
    index_.clear();
    J_.setZero(6, 96);
    const int a = columns(layout_.cameras[0], 6), b = columns(layout_.cameras[camera], 6);
    J_.block<3, 3>(0, a) = -wp * R_C0B;
    J_.block<3, 3>(0, a + 3) = wp * hat(now.p);
    J_.block<3, 3>(0, b) = wp * R_C0B;
    J_.block<3, 3>(3, a + 3) = -inverse * now.R().transpose();
    J_.block<3, 3>(3, b + 3) = inverse;
  }
  return add_rows(build);
}

bool ImuCameraProblem::solve(double lambda) {
  if (!system_->factorise(lambda)) return false;
  step_ = -system_->solve(system_->b());
  // Half of (lambda x^T D x - b^T x): what the quadratic model promises.
  predicted_ = 0.5 * (lambda * step_.cwiseAbs2().dot(system_->diagonal()) - system_->b().dot(step_));
  return step_.allFinite();
}

double ImuCameraProblem::step_size() const {
  return step_.segment(layout_.begin, layout_.end - layout_.begin).lpNorm<Eigen::Infinity>();
}

double ImuCameraProblem::apply_step() {
  before_ = state_;
  const auto at = [&](int index) { return Vec3(step_.segment<3>(index)); };
  std::vector<Pose<T, B>> knots = state_.path.knots();
  for (int k = 0; k < state_.path.size(); ++k) {
    Pose<T, B>& knot = knots[static_cast<std::size_t>(k)];
    knot = knot.boxplus(at(knot_index(k) + 3), at(knot_index(k)));
  }
  state_.path.set_knots(std::move(knots));
  for (std::size_t n = 0; n < state_.biases.size(); ++n) {
    state_.biases[n].gyro_radps += at(bias_index_[n]);
    state_.biases[n].accel_mps2 += at(bias_index_[n] + 3);
  }
  for (std::size_t c = 0; c < state_.T_BC.size(); ++c)
    state_.T_BC[c] = state_.T_BC[c].boxplus(at(layout_.cameras[c]), at(layout_.cameras[c] + 3));
  state_.time_offset_s += step_(layout_.time_offset);
  state_.gravity_T += at(layout_.gravity);
  if (layout_.board_scale >= 0) state_.board_scale += step_(layout_.board_scale);
  if (layout_.line_delay >= 0) state_.line_delay_s += step_(layout_.line_delay);
  if (layout_.later >= 0)
    for (std::size_t c = 1; c < state_.later_s.size(); ++c) state_.later_s[c] += step_(layout_.later + static_cast<int>(c) - 1);
  if (layout_.axes >= 0) {
    for (int row = 0; row < 3; ++row) state_.axes.gyro.row(row) += at(layout_.axes + 3 * row).transpose();
    for (int row = 0, i = layout_.axes + 9; row < 3; ++row)
      for (int column = 0; column <= row; ++column) state_.axes.accel(row, column) += step_(i++);
  }
  return evaluate(false);
}

double ImuCameraProblem::cost_after(Eigen::VectorXd step) {
  step_ = std::move(step);
  const double cost = apply_step();
  undo_step();
  return cost;
}

std::optional<Eigen::MatrixXd> ImuCameraProblem::calibration_covariance() {
  if (!system_->factorise()) return std::nullopt;
  return system_->inverse_tail(layout_.end - layout_.begin);
}

Eigen::VectorXd ImuCameraProblem::response(const RigVariation& variation) {
  const auto gradient_of_images = [&] {
    system_->set_zero();
    add_images(true);
    return Eigen::VectorXd(system_->b());
  };
  const Eigen::VectorXd before = gradient_of_images();
  std::vector<Camera> cameras = variation.cameras;
  std::vector<Pose<Cn, C0>> T_CnC0 = setup_.T_CnC0.empty() ? setup_.T_CnC0 : variation.T_CnC0;
  std::swap(data_.cameras, cameras);
  std::swap(setup_.T_CnC0, T_CnC0);
  const Eigen::VectorXd change = gradient_of_images() - before;
  std::swap(data_.cameras, cameras);
  std::swap(setup_.T_CnC0, T_CnC0);
  return -system_->solve(change).segment(layout_.begin, layout_.end - layout_.begin) / variation.sigmas;
}

ImuBias ImuCameraProblem::bias_sigma(int index) const {
  Vec6 sigma;
  const int begin = bias_index_[static_cast<std::size_t>(index)];
  for (int i = 0; i < 6; ++i) sigma(i) = std::sqrt(system_->solve(Eigen::VectorXd::Unit(system_->size(), begin + i))(begin + i));
  return {Vec3(sigma.head<3>()), Vec3(sigma.tail<3>())};
}

}  // namespace fbvins
