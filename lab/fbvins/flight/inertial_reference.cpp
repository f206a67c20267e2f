// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/inertial_reference.hpp"

#include <cmath>

#include "fbvins/sim/barometer.hpp"

namespace fbvins {
namespace {

/// Gain of levelling by the accelerometer: low, because accelerations of flight disturb it.
constexpr double kLevelling_per_s = 0.1;
/// Only readings within this of one g are used for levelling.
constexpr double kNearG_mps2 = 1.5;
// Complementary filter of third order with a triple pole at this frequency.
constexpr double kHeight_radps = 0.8;
/// Gain of the barometer's zero at each reading.
constexpr double kZeroFollows = 0.02;

}  // namespace

void InertialReference::predict(const ImuSample& reading, double dt_s) {
  following_ = false;
  Quat& q = state_.T_LV.q;
  state_.w_LV_V = mounting_.q * (reading.gyro_radps - bias_.gyro_radps);
  const Vec3 accel_V = mounting_.q * (reading.accel_mps2 - bias_.accel_mps2);
  Vec3 turn = dt_s * state_.w_LV_V;
  if (std::abs(accel_V.norm() - kSimGravity_mps2) < kNearG_mps2)
    turn += dt_s * kLevelling_per_s * accel_V.normalized().cross(q.conjugate() * Vec3::UnitZ());
  q = (q * so3_exp(turn)).normalized();
  const double a_z = (q * accel_V).z() - kSimGravity_mps2 + accel_z_error_mps2_;
  state_.T_LV.p.z() += dt_s * (state_.v_LV.z() + 0.5 * dt_s * a_z);
  state_.v_LV = Vec3(0, 0, state_.v_LV.z() + dt_s * a_z);
}

void InertialReference::follow(const VehicleEstimate& estimate, const ImuBias& bias) {
  state_ = estimate;
  bias_ = bias;
  accel_z_error_mps2_ = 0;
  following_ = true;
}

void InertialReference::correct(double barometer_m) {
  const double height = state_.T_LV.p.z();
  if (!zero_m_) zero_m_ = barometer_m - height;
  const double error = barometer_m - *zero_m_ - height, dt = 1 / Barometer::kRate_hz, w = kHeight_radps;
  if (following_) {  // the height is known: estimate the barometer's zero
    *zero_m_ += kZeroFollows * error;
    return;
  }
  state_.T_LV.p.z() += 3 * w * dt * error;
  state_.v_LV.z() += 3 * w * w * dt * error;
  accel_z_error_mps2_ += w * w * w * dt * error;
}

}  // namespace fbvins
