// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/preintegration.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>

namespace fbvins {
namespace {

using Mat9 = Eigen::Matrix<double, 9, 9>;
using Mat9x15 = Eigen::Matrix<double, 9, 15>;

/// Covariance of white noise of density^2 q on an acceleration, after dt, in (p, v): eq. P11.
void add_white_acceleration(double q, double dt, Mat9& noise) {
  noise.block<3, 3>(nav::p, nav::p).diagonal().array() += q * dt * dt * dt / 3;
  noise.block<3, 3>(nav::p, nav::v).diagonal().array() += q * dt * dt / 2;
  noise.block<3, 3>(nav::v, nav::p).diagonal().array() += q * dt * dt / 2;
  noise.block<3, 3>(nav::v, nav::v).diagonal().array() += q * dt;
}

double squared(double x) { return x * x; }

/// Covariance of the readings' white noise over a step: eq. P11.
Mat9 noise_of_step(const ImuNoise& density, const ImuNoiseScale& scale, double dt) {
  Mat9 noise = Mat9::Zero();
  noise.block<3, 3>(nav::theta, nav::theta).diagonal().array() +=
      squared(scale.gyro * density.gyro_noise_density_radps_rthz) * dt;
  add_white_acceleration(squared(scale.accel * density.accel_noise_density_mps2_rthz), dt, noise);
  return noise;
}

/// Covariance of the unknown deviation from a linear signal during a step inside an IMU gap: eq. P13.
void add_gap(const ImuGapModel& model, double gap_s, double dt, Mat9& noise) {
  const double ratio = std::min(1.0, gap_s / model.long_gap_s);
  const double w = model.gyro_sigma_radps * ratio * ratio * dt;
  const double a = model.accel_sigma_mps2 * ratio * ratio * dt;
  noise.block<3, 3>(nav::theta, nav::theta).diagonal().array() += w * w;
  add_white_acceleration(a * a / dt, dt, noise);
}

}  // namespace

Preintegration::Preintegration(const ImuNoise& noise, const ImuBias& linearisation_bias) : noise_(noise) {
  readings_.reserve(24);
  reset(linearisation_bias);
}

void Preintegration::reset(const ImuBias& bias) {
  bias_ = bias;
  deltas_ = {};
  J_theta_bg_.setZero();
  J_v_bg_.setZero();
  J_v_ba_.setZero();
  J_p_bg_.setZero();
  J_p_ba_.setZero();
  covariance_.setZero();
  longest_gap_s_ = 0;
  sqrt_information_valid_ = false;
}

void Preintegration::integrate(const ImuSegment& segment) {
  if (segment.empty()) return;
  assert((readings_.empty() || readings_.back().t == segment.samples.front().t) && "segments must be consecutive");
  const double longest_regular_s = std::min(gap_model_.longest_regular_step / noise_.rate_hz, gap_model_.longest_known_step_s);
  for (std::size_t k = 0; k < segment.samples.size(); ++k) {
    const ImuSample& s = segment.samples[k];
    if (k == 0 && !readings_.empty()) continue;
    const double dt = k == 0 ? 0.0 : (s.t - segment.samples[k - 1].t).seconds();
    // A step cut by an image stamp may be short and still lie in a long gap, whose length is longest_gap.
    const bool gap = dt > longest_regular_s;
    const double gap_s = segment.longest_gap.ns > 0 ? segment.longest_gap.seconds() : dt;
    push({s.t, s.gyro_radps, s.accel_mps2, gap ? gap_s : 0.0, segment.noise});
  }
}

void Preintegration::loosen_end(double sigma_s, const Vec3& velocity_B, const Vec3& gravity_B) {
  if (empty()) return;
  end_p_ = sigma_s * velocity_B;
  end_theta_ = sigma_s * (readings_.back().gyro_radps - bias_.gyro_radps);
  end_v_ = sigma_s * (readings_.back().accel_mps2 - bias_.accel_mps2 + gravity_B);
  sqrt_information_valid_ = false;
}

Mat15 Preintegration::covariance() const {
  Eigen::Matrix<double, 9, 1> end;
  end << deltas_.q * end_p_, end_theta_, deltas_.q * end_v_;
  Mat15 P = covariance_;
  P.topLeftCorner<9, 9>() += end * end.transpose();
  return P;
}

void Preintegration::append(const Preintegration& later) {
  if (later.empty()) return;
  assert((readings_.empty() || readings_.back().t == later.readings_.front().t) && "intervals must be consecutive");
  for (std::size_t k = readings_.empty() ? 0 : 1; k < later.readings_.size(); ++k) push(later.readings_[k]);
  end_p_ = later.end_p_, end_theta_ = later.end_theta_, end_v_ = later.end_v_;
}

void Preintegration::repropagate(const ImuBias& linearisation_bias) {
  reset(linearisation_bias);
  for (std::size_t k = 1; k < readings_.size(); ++k) step(readings_[k - 1], readings_[k]);
}

bool Preintegration::needs_repropagation(const ImuBias& bias, const RepropagationThreshold& threshold) const {
  return (bias.gyro_radps - bias_.gyro_radps).norm() * dt_s() > threshold.gyro_rad ||
         (bias.accel_mps2 - bias_.accel_mps2).norm() * dt_s() > threshold.accel_mps;
}

void Preintegration::push(const Reading& reading) {
  readings_.push_back(reading);
  if (readings_.size() >= 2) step(readings_[readings_.size() - 2], readings_.back());
}

void Preintegration::step(const Reading& from, const Reading& to) {
  const double dt = (to.t - from.t).seconds();
  if (dt <= 0) return;
  longest_gap_s_ = std::max(longest_gap_s_, to.gap_s);
  const Vec3 w0 = from.gyro_radps - bias_.gyro_radps, w1 = to.gyro_radps - bias_.gyro_radps;
  const Vec3 a0 = from.accel_mps2 - bias_.accel_mps2, a1 = to.accel_mps2 - bias_.accel_mps2;

  // Rotation: mean rate and the coning term of a rate that changes linearly (eq. P5).
  const Vec3 theta = 0.5 * dt * (w0 + w1) + dt * dt / 12 * w0.cross(w1);
  const Quat dq = so3_exp(theta);
  const Mat3 R0 = deltas_.q.toRotationMatrix();
  const Quat q1 = (deltas_.q * dq).normalized();
  const Mat3 R1 = q1.toRotationMatrix();
  const Mat3 Et = dq.toRotationMatrix().transpose();

  // Derivatives of the step (eq. P8-P10); the force changes linearly between its two ends in B_i.
  const Mat3 theta_bg = so3_right_jacobian(theta) * (-dt * Mat3::Identity() + dt * dt / 12 * hat(w1 - w0));
  const Mat3 f0 = -R0 * hat(a0), f1 = -R1 * hat(a1);
  const Mat3 f1_theta = f1 * Et, f1_bg = f1 * theta_bg;
  const double h = dt / 2, p0 = dt * dt / 3, p1 = dt * dt / 6;
  Mat9x15 F = Mat9x15::Zero();
  F.block<3, 3>(nav::p, nav::p).setIdentity();
  F.block<3, 3>(nav::p, nav::theta) = p0 * f0 + p1 * f1_theta;
  F.block<3, 3>(nav::p, nav::v) = dt * Mat3::Identity();
  F.block<3, 3>(nav::p, nav::bg) = p1 * f1_bg;
  F.block<3, 3>(nav::p, nav::ba) = -p0 * R0 - p1 * R1;
  F.block<3, 3>(nav::theta, nav::theta) = Et;
  F.block<3, 3>(nav::theta, nav::bg) = theta_bg;
  F.block<3, 3>(nav::v, nav::theta) = h * (f0 + f1_theta);
  F.block<3, 3>(nav::v, nav::v).setIdentity();
  F.block<3, 3>(nav::v, nav::bg) = h * f1_bg;
  F.block<3, 3>(nav::v, nav::ba) = -h * (R0 + R1);

  // Bias Jacobians: the same recursion applied to their columns (eq. P12).
  J_p_bg_ += F.block<3, 3>(nav::p, nav::theta) * J_theta_bg_ + dt * J_v_bg_ + F.block<3, 3>(nav::p, nav::bg);
  J_p_ba_ += dt * J_v_ba_ + F.block<3, 3>(nav::p, nav::ba);
  J_v_bg_ += F.block<3, 3>(nav::v, nav::theta) * J_theta_bg_ + F.block<3, 3>(nav::v, nav::bg);
  J_v_ba_ += F.block<3, 3>(nav::v, nav::ba);
  J_theta_bg_ = Et * J_theta_bg_ + theta_bg;

  // Covariance (eq. P11): white noise of the readings, random walk of the biases, missing readings.
  Mat9 noise = noise_of_step(noise_, to.noise, dt);
  if (to.gap_s > 0) add_gap(gap_model_, to.gap_s, dt, noise);
  const Mat9x15 FP = F * covariance_;
  covariance_.topLeftCorner<9, 9>() = FP * F.transpose() + noise;
  covariance_.topRightCorner<9, 6>() = FP.rightCols<6>();
  covariance_.bottomLeftCorner<6, 9>() = FP.rightCols<6>().transpose();
  covariance_.diagonal().segment<3>(nav::bg).array() += squared(noise_.gyro_random_walk_radps2_rthz) * dt;
  covariance_.diagonal().segment<3>(nav::ba).array() += squared(noise_.accel_random_walk_mps3_rthz) * dt;

  // Deltas last: the lines above need their values at the beginning of the step (eq. P6, P7).
  const Vec3 s0 = R0 * a0, s1 = R1 * a1;
  deltas_.p += dt * deltas_.v + p0 * s0 + p1 * s1;
  deltas_.v += h * (s0 + s1);
  deltas_.q = q1;
  sqrt_information_valid_ = false;
}

ImuDeltas Preintegration::corrected(const ImuBias& bias) const {
  const Vec3 dbg = bias.gyro_radps - bias_.gyro_radps, dba = bias.accel_mps2 - bias_.accel_mps2;
  return {(deltas_.q * so3_exp(J_theta_bg_ * dbg)).normalized(), deltas_.v + J_v_bg_ * dbg + J_v_ba_ * dba,
          deltas_.p + J_p_bg_ * dbg + J_p_ba_ * dba};
}

const Mat15& Preintegration::sqrt_information() const {
  if (!sqrt_information_valid_) {
    sqrt_information_.setZero();
    if (!empty()) {
      // Cholesky from the last row upwards gives covariance = V V^T with V upper; U = V^-1 (eq. P15).
      const Mat15 reversed = covariance().reverse();
      const Mat15 L = reversed.llt().matrixL();
      const Mat15 V = L.reverse();
      sqrt_information_ = V.triangularView<Eigen::Upper>().solve(Mat15::Identity());
    }
    sqrt_information_valid_ = true;
  }
  return sqrt_information_;
}

Mat15 Preintegration::predict_covariance(const Quat& q_FB, const ImuBias& bias, const Mat15& P_i) const {
  const ImuDeltas d = corrected(bias);
  const double dt = dt_s();
  const Mat3 R_i = q_FB.toRotationMatrix();
  Mat15 F = Mat15::Identity();  // d(state at j)/d(state at i), the derivative of predict()
  F.block<3, 3>(nav::p, nav::theta) = -R_i * hat(d.p);
  F.block<3, 3>(nav::p, nav::v) = dt * Mat3::Identity();
  F.block<3, 3>(nav::p, nav::bg) = R_i * J_p_bg_;
  F.block<3, 3>(nav::p, nav::ba) = R_i * J_p_ba_;
  F.block<3, 3>(nav::theta, nav::theta) = d.q.toRotationMatrix().transpose();
  F.block<3, 3>(nav::theta, nav::bg) = J_theta_bg_;
  F.block<3, 3>(nav::v, nav::theta) = -R_i * hat(d.v);
  F.block<3, 3>(nav::v, nav::bg) = R_i * J_v_bg_;
  F.block<3, 3>(nav::v, nav::ba) = R_i * J_v_ba_;
  Mat15 G = Mat15::Identity();  // the deltas' p and v are in B_i
  G.block<3, 3>(nav::p, nav::p) = G.block<3, 3>(nav::v, nav::v) = R_i;
  return F * P_i * F.transpose() + G * covariance() * G.transpose();
}

}  // namespace fbvins
