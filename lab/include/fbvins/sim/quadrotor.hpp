// SPDX-License-Identifier: Apache-2.0
// A quadrotor as a rigid body: rotor lag and saturation, battery sag, rotor drag, ground effect, wind, legs on the floor.
// Integrated by the fourth-order Runge-Kutta method with fixed steps; the same commands give the same bits.
//
//   Quadrotor vehicle(*quadrotor_preset("indoor330"), standing_at({0, 0}, heading_rad, options));
//   vehicle.step({0.4, 0.4, 0.4, 0.4}, wind_W);       // one millisecond
//   MotionState imu = vehicle.motion_of(mounting);    // motion of a sensor aboard
//
// Frames: W has z up and the floor at z = 0, V is the vehicle (x forward, y left, z up, origin at the centre of mass).
// Rotors in PX4's order: front right, rear left (both counter-clockwise from above), front left, rear right (clockwise).
// Threads: one owner.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/sim/spline.hpp"

namespace fbvins {

/// The vehicle: x forward, y left, z up.
struct BodyFlu {};

inline constexpr int kRotors = 4;
/// A value for each rotor, in PX4's order.
using PerRotor = std::array<double, kRotors>;

struct QuadrotorOptions {
  double mass_kg = 1.5;
  double inertia_x_kgm2 = 0.0165, inertia_y_kgm2 = 0.0175, inertia_z_kgm2 = 0.029;
  double arm_x_m = 0.1167, arm_y_m = 0.1167;
  double rotor_radius_m = 0.114;
  double thrust_N_per_radps2 = 1.45e-5;
  double torque_per_thrust_m = 0.015;
  double rotor_inertia_kgm2 = 3e-5;
  double rotor_max_radps = 815;
  bool command_is_thrust = false;
  double spin_up_s = 0.03, spin_down_s = 0.045;
  double rotor_drag_Ns2_per_rad_m = 1.5e-4;
  double drag_Ns2_per_m2 = 0.02;
  double drag_Ns_per_m = 0;
  double angular_drag_Nms = 0.004;
  bool ground_effect = true;
  double leg_m = 0.2;
  double battery_full_V = 16.8, battery_empty_V = 14.0;
  double battery_capacity_As = 18000;
  double battery_resistance_ohm = 0.03;
  double power_efficiency = 0.6;

  template <class Visitor>
  void visit(Visitor&& v) {
    v("mass_kg", mass_kg, "kg", "of the whole vehicle", 0.05, 50.0);
    v("inertia_x_kgm2", inertia_x_kgm2, "kg m^2", "about the forward axis", 1e-5, 10.0);
    v("inertia_y_kgm2", inertia_y_kgm2, "kg m^2", "about the left axis", 1e-5, 10.0);
    v("inertia_z_kgm2", inertia_z_kgm2, "kg m^2", "about the upward axis", 1e-5, 10.0);
    v("arm_x_m", arm_x_m, "m", "a rotor's distance from the centre, forward", 0.01, 2.0);
    v("arm_y_m", arm_y_m, "m", "a rotor's distance from the centre, sideways", 0.01, 2.0);
    v("rotor_radius_m", rotor_radius_m, "m", "of a propeller", 0.01, 1.0);
    v("thrust_N_per_radps2", thrust_N_per_radps2, "N s^2", "thrust of a rotor over the square of its speed", 1e-8, 1e-2);
    v("torque_per_thrust_m", torque_per_thrust_m, "m", "torque of a rotor over its thrust", 1e-4, 1.0);
    v("rotor_inertia_kgm2", rotor_inertia_kgm2, "kg m^2", "of a propeller with its motor's bell", 0.0, 0.1);
    v("rotor_max_radps", rotor_max_radps, "rad/s", "at full command and full battery", 10.0, 10000.0);
    v("command_is_thrust", command_is_thrust, "", "commands are shares of full thrust, not of full speed");
    v("spin_up_s", spin_up_s, "s", "time constant of an accelerating rotor", 0.002, 1.0);
    v("spin_down_s", spin_down_s, "s", "time constant of a decelerating rotor", 0.002, 1.0);
    v("rotor_drag_Ns2_per_rad_m", rotor_drag_Ns2_per_rad_m, "N s^2/(rad m)", "drag of a spinning rotor in its plane", 0.0, 0.1);
    v("drag_Ns2_per_m2", drag_Ns2_per_m2, "N s^2/m^2", "quadratic drag of the body", 0.0, 10.0);
    v("drag_Ns_per_m", drag_Ns_per_m, "N s/m", "linear drag of the body", 0.0, 10.0);
    v("angular_drag_Nms", angular_drag_Nms, "N m s", "rotational drag of the body", 0.0, 1.0);
    v("ground_effect", ground_effect, "", "more thrust near the floor");
    v("leg_m", leg_m, "m", "height of the centre of mass over the feet", 0.02, 2.0);
    v("battery_full_V", battery_full_V, "V", "open-circuit voltage, full", 1.0, 100.0);
    v("battery_empty_V", battery_empty_V, "V", "open-circuit voltage, empty", 1.0, 100.0);
    v("battery_capacity_As", battery_capacity_As, "A s", "from full to empty", 10.0, 1e7);
    v("battery_resistance_ohm", battery_resistance_ohm, "ohm", "internal resistance", 0.0, 1.0);
    v("power_efficiency", power_efficiency, "", "of motors and their controllers", 0.05, 1.0);
  }
};

/// indoor330: 1.5 kg, 330 mm from rotor to rotor, as the paper's machine; sih: the quadrotor of PX4's simulation in hardware.
std::vector<std::string> quadrotor_presets();
Result<QuadrotorOptions> quadrotor_preset(const std::string& name);

struct QuadrotorState {
  Pose<W, BodyFlu> T_WV;
  Vec3 v_WV = Vec3::Zero();    ///< m/s, in W
  Vec3 w_WV_V = Vec3::Zero();  ///< rad/s, in V
  PerRotor rotor_radps{};
  double charge_used_As = 0;
};

/// On its legs, rotors at rest.
QuadrotorState standing_at(const Vec2& place, double heading_rad, const QuadrotorOptions& options);

class Quadrotor {
 public:
  static constexpr double kStep_s = 1e-3;

  Quadrotor(const QuadrotorOptions& options, const QuadrotorState& start);

  /// One step of kStep_s; commands in [0, 1] (others are clamped), the wind in W, m/s.
  void step(const PerRotor& commands, const Vec3& wind_W);

  const QuadrotorOptions& options() const { return options_; }
  const QuadrotorState& state() const { return state_; }
  double battery_V() const { return battery_V_; }
  /// Whether weight is on the legs.
  bool on_ground() const { return on_ground_; }
  /// Motion of a frame that is fixed to the vehicle at `mounting`.
  MotionState motion_of(const Pose<BodyFlu, B>& mounting) const;

 private:
  /// Time derivatives of the state; q: of the quaternion's coefficients.
  struct Rates {
    Vec3 p, v, w;
    Eigen::Vector4d q;
    PerRotor rotor;
  };
  /// Force and torque on the body, in V; the torque about its centre.
  struct Wrench {
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  };
  Rates rates(const QuadrotorState& s, const PerRotor& target_radps, const Vec3& wind_W) const;
  PerRotor targets(const PerRotor& commands) const;
  Wrench rotor_wrench(const QuadrotorState& s, const PerRotor& acceleration) const;
  Wrench air_wrench(const QuadrotorState& s, const Vec3& wind_W) const;
  Wrench ground_wrench(const QuadrotorState& s) const;
  void drain_battery();

  QuadrotorOptions options_;
  QuadrotorState state_;
  Vec3 inertia_;
  std::array<Vec3, kRotors> rotor_V_;
  Vec3 a_WV_ = Vec3::Zero(), dw_WV_V_ = Vec3::Zero();
  double battery_V_;
  bool on_ground_ = true;
};

/// +1 for a rotor that turns counter-clockwise seen from above.
inline constexpr std::array<double, kRotors> kRotorSense{1, 1, -1, -1};

}  // namespace fbvins
