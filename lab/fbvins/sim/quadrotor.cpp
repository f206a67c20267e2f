// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/quadrotor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

const Vec3 kGravity_W(0, 0, -kSimGravity_mps2);
// Legs: stiff enough to stand on, soft enough for the step.
constexpr double kFootStiffness_N_per_m = 4000, kFootDamping_Ns_per_m = 60;
constexpr double kFriction = 0.7, kCreep_Ns_per_m = 60;
/// Below this height the formula of the ground effect no longer holds.
constexpr double kLowestGroundEffect_radii = 0.6;

QuadrotorState advanced(const QuadrotorState& s, const Vec3& p, const Vec3& v, const Eigen::Vector4d& q, const Vec3& w,
                        const PerRotor& rotor, double dt) {
  QuadrotorState next = s;
  next.T_WV.p += dt * p;
  next.v_WV += dt * v;
  next.T_WV.q.coeffs() += dt * q;
  next.w_WV_V += dt * w;
  for (int i = 0; i < kRotors; ++i) next.rotor_radps[i] += dt * rotor[i];
  return next;
}

/// Cheeseman and Bennett: thrust near the ground over thrust far from it.
double ground_effect(double height_m, double radius_m) {
  const double ratio = radius_m / (4 * std::max(height_m, kLowestGroundEffect_radii * radius_m));
  return 1 / (1 - ratio * ratio);
}

/// PX4's defaults (SIH_*): 1 kg, 5 N and 0.1 N m per rotor at full thrust, motors of 50 ms, linear drag.
QuadrotorOptions sih() {
  QuadrotorOptions o;
  o.mass_kg = 1;
  o.inertia_x_kgm2 = o.inertia_y_kgm2 = 0.025;
  o.inertia_z_kgm2 = 0.03;
  o.arm_x_m = o.arm_y_m = 0.2;
  o.thrust_N_per_radps2 = 5.0 / (800 * 800);
  o.rotor_max_radps = 800;
  o.torque_per_thrust_m = 0.1 / 5.0;
  o.rotor_inertia_kgm2 = 0;
  o.command_is_thrust = true;
  o.spin_up_s = o.spin_down_s = 0.05;
  o.rotor_drag_Ns2_per_rad_m = o.drag_Ns2_per_m2 = 0;
  o.drag_Ns_per_m = 1;
  o.angular_drag_Nms = 0.025;
  o.ground_effect = false;
  o.battery_resistance_ohm = 0;
  o.battery_empty_V = o.battery_full_V;
  return o;
}

}  // namespace

std::vector<std::string> quadrotor_presets() { return {"indoor330", "sih"}; }

Result<QuadrotorOptions> quadrotor_preset(const std::string& name) {
  if (name == "indoor330") return QuadrotorOptions{};
  if (name == "sih") return sih();
  return Error{ErrorCode::invalid_argument, fmt::format("there is no vehicle '{}'; there are indoor330, sih", name)};
}

QuadrotorState standing_at(const Vec2& place, double heading_rad, const QuadrotorOptions& options) {
  QuadrotorState s;
  const double sunk_m = options.mass_kg * kSimGravity_mps2 / (kRotors * kFootStiffness_N_per_m);
  s.T_WV = {so3_exp(Vec3(0, 0, heading_rad)), Vec3(place.x(), place.y(), options.leg_m - sunk_m)};
  return s;
}

Quadrotor::Quadrotor(const QuadrotorOptions& options, const QuadrotorState& start)
    : options_(options),
      state_(start),
      inertia_(options.inertia_x_kgm2, options.inertia_y_kgm2, options.inertia_z_kgm2),
      rotor_V_{Vec3(options.arm_x_m, -options.arm_y_m, 0), Vec3(-options.arm_x_m, options.arm_y_m, 0),
               Vec3(options.arm_x_m, options.arm_y_m, 0), Vec3(-options.arm_x_m, -options.arm_y_m, 0)},
      battery_V_(options.battery_full_V) {
  const Rates r = rates(state_, state_.rotor_radps, Vec3::Zero());
  a_WV_ = r.v;
  dw_WV_V_ = r.w;
}

PerRotor Quadrotor::targets(const PerRotor& commands) const {
  const double fastest = options_.rotor_max_radps * battery_V_ / options_.battery_full_V;
  PerRotor target{};
  for (int i = 0; i < kRotors; ++i) {
    const double c = std::clamp(commands[i], 0.0, 1.0);
    target[i] = fastest * (options_.command_is_thrust ? std::sqrt(c) : c);
  }
  return target;
}

/// Thrust, its moments, aerodynamic torque, and the torque of the rotors' inertia.
Quadrotor::Wrench Quadrotor::rotor_wrench(const QuadrotorState& s, const PerRotor& acceleration) const {
  Wrench sum;
  double spin = 0;  // of all rotors, kg m^2 rad/s
  for (int i = 0; i < kRotors; ++i) {
    double thrust = options_.thrust_N_per_radps2 * s.rotor_radps[i] * s.rotor_radps[i];
    const double torque = options_.torque_per_thrust_m * thrust;
    if (options_.ground_effect) thrust *= ground_effect((s.T_WV * rotor_V_[i]).z(), options_.rotor_radius_m);
    sum.force.z() += thrust;
    sum.torque += rotor_V_[i].cross(Vec3(0, 0, thrust));
    sum.torque.z() -= kRotorSense[i] * (torque + options_.rotor_inertia_kgm2 * acceleration[i]);
    spin += kRotorSense[i] * options_.rotor_inertia_kgm2 * s.rotor_radps[i];
  }
  sum.torque -= s.w_WV_V.cross(Vec3(0, 0, spin));
  return sum;
}

Quadrotor::Wrench Quadrotor::air_wrench(const QuadrotorState& s, const Vec3& wind_W) const {
  const Vec3 through_air = s.T_WV.q.conjugate() * (s.v_WV - wind_W);
  double turning = 0;
  for (double w : s.rotor_radps) turning += w;
  Wrench sum;
  sum.force = -(options_.drag_Ns2_per_m2 * through_air.norm() + options_.drag_Ns_per_m) * through_air;
  sum.force -= options_.rotor_drag_Ns2_per_rad_m * turning * Vec3(through_air.x(), through_air.y(), 0);
  sum.torque = -options_.angular_drag_Nms * s.w_WV_V;
  return sum;
}

/// Four feet beneath the rotors: springs with dampers, and friction, viscous at low speed.
Quadrotor::Wrench Quadrotor::ground_wrench(const QuadrotorState& s) const {
  Wrench sum;
  if (s.T_WV.p.z() > 2 * options_.leg_m + options_.arm_x_m) return sum;
  for (const Vec3& rotor : rotor_V_) {
    const Vec3 foot = rotor - Vec3(0, 0, options_.leg_m);
    const double depth_m = -(s.T_WV * foot).z();
    if (depth_m <= 0) continue;
    const Vec3 v_W = s.v_WV + s.T_WV.q * s.w_WV_V.cross(foot);
    const double push = std::max(0.0, kFootStiffness_N_per_m * depth_m - kFootDamping_Ns_per_m * v_W.z());
    const Vec3 sliding(v_W.x(), v_W.y(), 0);
    const double speed = sliding.norm();
    Vec3 force_W(0, 0, push);
    if (speed > 0) force_W -= std::min(kFriction * push, kCreep_Ns_per_m * speed) / speed * sliding;
    const Vec3 force = s.T_WV.q.conjugate() * force_W;
    sum.force += force;
    sum.torque += foot.cross(force);
  }
  return sum;
}

Quadrotor::Rates Quadrotor::rates(const QuadrotorState& s, const PerRotor& target_radps, const Vec3& wind_W) const {
  Rates r;
  for (int i = 0; i < kRotors; ++i) {
    const double missing = target_radps[i] - s.rotor_radps[i];
    r.rotor[i] = missing / (missing > 0 ? options_.spin_up_s : options_.spin_down_s);
  }
  const Wrench rotors = rotor_wrench(s, r.rotor), air = air_wrench(s, wind_W), ground = ground_wrench(s);
  r.p = s.v_WV;
  r.v = kGravity_W + s.T_WV.q.normalized() * (rotors.force + air.force + ground.force) / options_.mass_kg;
  const Vec3 torque = rotors.torque + air.torque + ground.torque;
  r.w = (torque - s.w_WV_V.cross(inertia_.cwiseProduct(s.w_WV_V))).cwiseQuotient(inertia_);
  const Quat turning = s.T_WV.q * Quat(0, s.w_WV_V.x(), s.w_WV_V.y(), s.w_WV_V.z());
  r.q = 0.5 * turning.coeffs();
  return r;
}

void Quadrotor::step(const PerRotor& commands, const Vec3& wind_W) {
  const PerRotor target = targets(commands);
  const auto at = [&](const Rates& r, double dt) { return advanced(state_, r.p, r.v, r.q, r.w, r.rotor, dt); };
  const Rates k1 = rates(state_, target, wind_W);
  const Rates k2 = rates(at(k1, 0.5 * kStep_s), target, wind_W);
  const Rates k3 = rates(at(k2, 0.5 * kStep_s), target, wind_W);
  const Rates k4 = rates(at(k3, kStep_s), target, wind_W);
  const auto mean = [](const auto& a, const auto& b, const auto& c, const auto& d) {
    return ((a + 2 * b + 2 * c + d) / 6).eval();
  };
  PerRotor rotor{};
  for (int i = 0; i < kRotors; ++i) rotor[i] = (k1.rotor[i] + 2 * k2.rotor[i] + 2 * k3.rotor[i] + k4.rotor[i]) / 6;
  state_ = advanced(state_, mean(k1.p, k2.p, k3.p, k4.p), mean(k1.v, k2.v, k3.v, k4.v), mean(k1.q, k2.q, k3.q, k4.q),
                    mean(k1.w, k2.w, k3.w, k4.w), rotor, kStep_s);
  state_.T_WV.q.normalize();
  drain_battery();
  const Rates now = rates(state_, target, wind_W);
  a_WV_ = now.v;
  dw_WV_V_ = now.w;
  on_ground_ = ground_wrench(state_).force.norm() > 0.1 * options_.mass_kg * kSimGravity_mps2;
}

void Quadrotor::drain_battery() {
  double power_W = 0;
  for (double w : state_.rotor_radps)
    power_W += options_.torque_per_thrust_m * options_.thrust_N_per_radps2 * w * w * w / options_.power_efficiency;
  const double current_A = power_W / battery_V_;
  state_.charge_used_As += current_A * kStep_s;
  const double used = std::min(1.0, state_.charge_used_As / options_.battery_capacity_As);
  battery_V_ = options_.battery_full_V - used * (options_.battery_full_V - options_.battery_empty_V) -
               options_.battery_resistance_ohm * current_A;
  battery_V_ = std::max(battery_V_, 0.5 * options_.battery_empty_V);
}

MotionState Quadrotor::motion_of(const Pose<BodyFlu, B>& mounting) const {
  const Quat& q = state_.T_WV.q;
  const Vec3 &w = state_.w_WV_V, &arm = mounting.p;
  MotionState m;
  m.T_WB = state_.T_WV * mounting;
  m.v_WB = state_.v_WV + q * w.cross(arm);
  m.a_WB = a_WV_ + q * (dw_WV_V_.cross(arm) + w.cross(w.cross(arm)));
  m.w_WB_B = mounting.q.conjugate() * w;
  m.dw_WB_B = mounting.q.conjugate() * dw_WV_V_;
  return m;
}

}  // namespace fbvins
