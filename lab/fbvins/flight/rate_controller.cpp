// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/rate_controller.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fbvins {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;
/// The integral gain fades to zero at this rate error (as in PX4).
constexpr double kIntegralFades_radps = 400 * kRadPerDeg;
/// Each rotor's change of thrust for unit torques about V's axes, in PX4's order of rotors.
constexpr double kTilt = 1 / std::numbers::sqrt2;
constexpr double kMix[kRotors][3] = {{-kTilt, -kTilt, -1}, {kTilt, kTilt, -1}, {kTilt, -kTilt, 1}, {-kTilt, kTilt, 1}};

}  // namespace

// Brescianini, Hehn, D'Andrea: Nonlinear quadrocopter attitude control, 2013: the thrust direction by the shortest rotation,
// and yaw with a reduced weight.
Vec3 rates_for(const AttitudeControlOptions& o, const Quat& q, const AttitudeSetpoint& wanted) {
  const Vec3 z = q * Vec3::UnitZ(), z_wanted = wanted.q_LV * Vec3::UnitZ();
  Quat reduced = so3_between(z, z_wanted) * q;
  if (z.dot(z_wanted) < -0.99999) reduced = wanted.q_LV;  // opposite directions: the shortest rotation is not unique
  Quat yaw_part = reduced.conjugate() * wanted.q_LV;
  if (yaw_part.w() < 0) yaw_part.coeffs() *= -1;
  const double half = std::asin(std::clamp(yaw_part.z(), -1.0, 1.0));
  const Quat target = reduced * Quat(std::cos(o.MC_YAW_WEIGHT * half), 0, 0, std::sin(o.MC_YAW_WEIGHT * half));
  Quat error = q.conjugate() * target;
  if (error.w() < 0) error.coeffs() *= -1;
  // Divided by the weight, the gain at small yaw errors is MC_YAW_P.
  const Vec3 gain(o.MC_ROLL_P, o.MC_PITCH_P, o.MC_YAW_WEIGHT > 1e-4 ? o.MC_YAW_P / o.MC_YAW_WEIGHT : o.MC_YAW_P);
  Vec3 rates = gain.cwiseProduct(2 * error.vec()) + q.conjugate() * Vec3(0, 0, wanted.yaw_rate_radps);
  const Vec3 most = kRadPerDeg * Vec3(o.MC_ROLLRATE_MAX, o.MC_PITCHRATE_MAX, o.MC_YAWRATE_MAX);
  return rates.cwiseMax(-most).cwiseMin(most);
}

RateController::RateController(const RateControlOptions& o, double rate_hz)
    : options_(o),
      dt_s_(1 / rate_hz),
      P_(o.MC_ROLLRATE_P, o.MC_PITCHRATE_P, o.MC_YAWRATE_P),
      I_(o.MC_ROLLRATE_I, o.MC_PITCHRATE_I, o.MC_YAWRATE_I),
      D_(o.MC_ROLLRATE_D, o.MC_PITCHRATE_D, o.MC_YAWRATE_D),
      FF_(o.MC_ROLLRATE_FF, o.MC_PITCHRATE_FF, o.MC_YAWRATE_FF),
      limit_(o.MC_RR_INT_LIM, o.MC_PR_INT_LIM, o.MC_YR_INT_LIM),
      rate_filter_(rate_hz, o.IMU_GYRO_CUTOFF),
      acceleration_filter_(rate_hz, o.IMU_DGYRO_CUTOFF) {}

Vec3 RateController::update(const Vec3& measured, const Vec3& wanted, const TorqueSaturation& saturation) {
  rate_ = rate_filter_(measured);
  const Vec3 acceleration = acceleration_filter_(last_ ? Vec3((rate_ - *last_) / dt_s_) : Vec3(Vec3::Zero()));
  last_ = rate_;
  const Vec3 error = wanted - rate_;
  const Vec3 torque = P_.cwiseProduct(error) + integral_ - D_.cwiseProduct(acceleration) + FF_.cwiseProduct(wanted);
  for (int i = 0; i < 3; ++i) {
    double e = error[i];
    if (saturation.positive[i]) e = std::min(e, 0.0);
    if (saturation.negative[i]) e = std::max(e, 0.0);
    const double fade = std::max(0.0, 1 - std::pow(e / kIntegralFades_radps, 2));
    integral_[i] = std::clamp(integral_[i] + fade * I_[i] * e * dt_s_, -limit_[i], limit_[i]);
  }
  return torque;
}

MixedMotors mix(double thrust, const Vec3& torque, double thrust_model) {
  PerRotor share{};
  for (int i = 0; i < kRotors; ++i) share[i] = kMix[i][0] * torque.x() + kMix[i][1] * torque.y();
  const auto [least, most] = std::minmax_element(share.begin(), share.end());
  const double span = *most - *least, scale = span > 1 ? 1 / span : 1;
  double base = std::min(thrust, 1 - scale * *most);
  const double tilt_scale = *least < 0 ? std::min(scale, std::max(0.0, base) / -*least) : scale;
  base = std::max(base, 0.0);

  MixedMotors out;
  const bool tilt_cut = tilt_scale < 1 - 1e-9;
  double room = 1;  // share of the yaw torque that fits
  for (int i = 0; i < kRotors; ++i) {
    share[i] = base + tilt_scale * share[i];
    const double yaw = kMix[i][2] * torque.z();
    const double up = 1 - share[i], down = share[i];
    if (yaw > up) room = std::min(room, std::max(0.0, up) / yaw);
    if (-yaw > down) room = std::min(room, std::max(0.0, down) / -yaw);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const bool cut = axis < 2 ? tilt_cut : room < 1 - 1e-9;
    out.saturation.positive[axis] = cut && torque[axis] > 0;
    out.saturation.negative[axis] = cut && torque[axis] < 0;
  }
  for (int i = 0; i < kRotors; ++i) {
    const double wanted = std::clamp(share[i] + room * kMix[i][2] * torque.z(), 0.0, 1.0);
    // thrust = fac * c^2 + (1 - fac) * c, solved for c
    const double linear = 1 - thrust_model;
    out.commands[i] =
        thrust_model > 1e-6 ? (-linear + std::sqrt(linear * linear + 4 * thrust_model * wanted)) / (2 * thrust_model) : wanted;
  }
  return out;
}

}  // namespace fbvins
