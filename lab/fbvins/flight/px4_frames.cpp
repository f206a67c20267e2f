// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/px4_frames.hpp"

#include <fmt/format.h>

#include <cmath>

#include "fbvins/mavlink/vehicle_frames.hpp"

namespace fbvins {
namespace {

float to_float(double x) { return static_cast<float>(x); }

/// Lists gains and limits by PX4's names.
struct ParameterList {
  Px4Parameters& out;
  template <class... Rest>
  void operator()(const char* name, const double& value, Rest&&...) {
    out.emplace_back(name, fmt::format("{:.6g}", value));
  }
  template <class T>
  void group(const char*, T& options, const char*) {
    options.visit(*this);
  }
};

/// Settings that differ from PX4's defaults for every vehicle.
const Px4Parameters& fixed_parameters() {
  static const Px4Parameters parameters{
      // Vision is the reference; EKF2 estimates the barometer's bias, so that there is a height when vision fails.
      {"EKF2_EV_CTRL", "15"},
      {"EKF2_HGT_REF", "3"},
      {"EKF2_GPS_CTRL", "0"},
      {"EKF2_BARO_CTRL", "1"},
      {"EKF2_MAG_TYPE", "5"},
      {"EKF2_EV_DELAY", "0"},
      {"EKF2_EV_NOISE_MD", "0"},
      {"EKF2_EV_QMIN", "1"},
      {"EKF2_EVA_NOISE", "0.05"},
      {"EKF2_MULTI_IMU", "0"},
      {"SENS_IMU_MODE", "1"},
      {"SYS_HAS_MAG", "0"},
      {"SYS_HAS_GPS", "0"},
      {"COM_ARM_WO_GPS", "1"},
      // No remote control or ground station; without setpoints or position it lands at once.
      {"COM_RC_IN_MODE", "4"},
      {"COM_RCL_EXCEPT", "7"},
      {"NAV_DLL_ACT", "0"},
      {"COM_OBL_RC_ACT", "4"},
      {"COM_FAIL_ACT_T", "0"},
      {"CBRK_SUPPLY_CHK", "894281"},
      {"COM_LOW_BAT_ACT", "0"},
      {"MPC_TKO_RAMP_T", "1"},
      {"SDLOG_MODE", "0"},
      {"SDLOG_PROFILE", "17"},
  };
  return parameters;
}

}  // namespace

Vec3 flu_to_frd(const Vec3& v) { return {v.x(), -v.y(), -v.z()}; }
Quat flu_to_frd(const Quat& q) { return {q.w(), q.x(), -q.y(), -q.z()}; }

MountingOptions mounting_options_of(const Pose<BodyFlu, B>& mounting, bool in_map) {
  const Quat half_turn(0, 1, 0, 0);
  const Quat q_FB = half_turn * mounting.q;
  MountingOptions best;
  double least = 10;  // the axes with the smallest residual rotation are far from gimbal lock
  for (const ImuAxes axes : {ImuAxes::flu, ImuAxes::frd, ImuAxes::camera_fwd, ImuAxes::camera_down}) {
    MountingOptions options;
    if (in_map) options.local_frame = LocalOrigin::map;
    options.imu_axes = axes;
    const Quat turn = q_FB * fbvins::mounting(options).q.conjugate();
    const double angle = so3_log(turn).norm();
    if (angle >= least) continue;
    least = angle;
    const Mat3 R = turn.normalized().toRotationMatrix();
    options.roll_rad = std::atan2(R(2, 1), R(2, 2));
    options.pitch_rad = -std::asin(std::clamp(R(2, 0), -1.0, 1.0));
    options.yaw_rad = std::atan2(R(1, 0), R(0, 0));
    best = options;
  }
  const Vec3 p_F = flu_to_frd(mounting.p);
  best.x_m = p_F.x(), best.y_m = p_F.y(), best.z_m = p_F.z();
  return best;
}

VehicleEstimate estimate_of(const OdometryMessage& m) {
  VehicleEstimate e;
  const Quat q = Quat(m.q[0], m.q[1], m.q[2], m.q[3]).normalized();
  e.T_LV = {flu_to_frd(q), flu_to_frd(Vec3(m.x, m.y, m.z))};
  const Vec3 v(m.vx, m.vy, m.vz);
  e.v_LV = flu_to_frd(m.child_frame_id == kMavFrameBodyFrd ? Vec3(q * v) : v);
  e.w_LV_V = flu_to_frd(Vec3(m.rollspeed, m.pitchspeed, m.yawspeed));
  return e;
}

PositionTargetMessage target_message(const PathSetpoint& setpoint, const Pose<Local, Px4Local>& T_LN,
                                     std::uint32_t time_boot_ms) {
  const Quat q_NL = T_LN.q.conjugate();
  const Vec3 p = flu_to_frd(Vec3(q_NL * (setpoint.p - T_LN.p))), v = flu_to_frd(Vec3(q_NL * setpoint.v)),
             a = flu_to_frd(Vec3(q_NL * setpoint.a));
  const Vec3 nose = flu_to_frd(Vec3(q_NL * Vec3(std::cos(setpoint.yaw_rad), std::sin(setpoint.yaw_rad), 0)));
  PositionTargetMessage m;
  m.time_boot_ms = time_boot_ms;
  m.x = to_float(p.x()), m.y = to_float(p.y()), m.z = to_float(p.z());
  m.vx = to_float(v.x()), m.vy = to_float(v.y()), m.vz = to_float(v.z());
  m.afx = to_float(a.x()), m.afy = to_float(a.y()), m.afz = to_float(a.z());
  m.yaw = to_float(std::atan2(nose.y(), nose.x())), m.yaw_rate = to_float(-setpoint.yaw_rate_radps);
  return m;
}

HilSensorMessage sensor_message(const BoardReading& reading, std::uint64_t time_usec) {
  const Vec3 a = flu_to_frd(reading.accel), w = flu_to_frd(reading.gyro);
  HilSensorMessage m;
  m.time_usec = time_usec;
  m.xacc = to_float(a.x()), m.yacc = to_float(a.y()), m.zacc = to_float(a.z());
  m.xgyro = to_float(w.x()), m.ygyro = to_float(w.y()), m.zgyro = to_float(w.z());
  m.temperature = 20;
  m.fields_updated = HilSensorMessage::kImu;
  return m;
}

void add_height(HilSensorMessage& message, double height_m) {
  constexpr double kSeaLevel_hPa = 1013.25, kLapse_per_m = 0.0065 / 288.15, kExponent = 9.80665 / (287.05 * 0.0065);
  message.abs_pressure = to_float(kSeaLevel_hPa * std::pow(1 - kLapse_per_m * height_m, kExponent));
  message.pressure_alt = to_float(height_m);
  message.fields_updated |= HilSensorMessage::kBarometer;
}

Px4Parameters px4_parameters(const ControlOptions& control, const QuadrotorOptions& vehicle) {
  Px4Parameters parameters = fixed_parameters();
  ControlOptions gains = control;
  ParameterList list{parameters};
  gains.visit(list);
  // Same order of rotors as PX4. There y is to the right, and a counter-clockwise rotor has a positive moment.
  const double x = vehicle.arm_x_m, y = vehicle.arm_y_m, forward[kRotors] = {x, -x, x, -x}, right[kRotors] = {y, -y, -y, y};
  for (int i = 0; i < kRotors; ++i) {
    parameters.emplace_back(fmt::format("CA_ROTOR{}_PX", i), fmt::format("{:.4f}", forward[i]));
    parameters.emplace_back(fmt::format("CA_ROTOR{}_PY", i), fmt::format("{:.4f}", right[i]));
    const double moment = kRotorSense[static_cast<std::size_t>(i)] * vehicle.torque_per_thrust_m;
    parameters.emplace_back(fmt::format("CA_ROTOR{}_KM", i), fmt::format("{:.4f}", moment));
  }
  return parameters;
}

}  // namespace fbvins
