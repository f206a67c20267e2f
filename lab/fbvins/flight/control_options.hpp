// SPDX-License-Identifier: Apache-2.0
// The gains and limits of the cascaded controller, with the names, units and defaults of PX4's parameters (v1.15), so that
// tuned values can be used in PX4.
#pragma once

namespace fbvins {

struct PositionControlOptions {
  double MPC_XY_P = 0.95, MPC_Z_P = 1.0;
  double MPC_XY_VEL_P_ACC = 1.8, MPC_XY_VEL_I_ACC = 0.4, MPC_XY_VEL_D_ACC = 0.2;
  double MPC_Z_VEL_P_ACC = 4.0, MPC_Z_VEL_I_ACC = 2.0, MPC_Z_VEL_D_ACC = 0.0;
  double MPC_XY_VEL_MAX = 12, MPC_Z_VEL_MAX_UP = 3, MPC_Z_VEL_MAX_DN = 1.5;
  double MPC_TILTMAX_AIR = 45;
  double MPC_THR_HOVER = 0.38, MPC_THR_MIN = 0.08, MPC_THR_MAX = 1.0;
  double MPC_VELD_LP = 5;

  template <class V>
  void visit(V&& v) {
    v("MPC_XY_P", MPC_XY_P, "1/s", "horizontal position error to velocity setpoint", 0.0, 10.0);
    v("MPC_Z_P", MPC_Z_P, "1/s", "vertical position error to velocity setpoint", 0.0, 10.0);
    v("MPC_XY_VEL_P_ACC", MPC_XY_VEL_P_ACC, "1/s", "horizontal velocity error to acceleration setpoint", 0.0, 20.0);
    v("MPC_XY_VEL_I_ACC", MPC_XY_VEL_I_ACC, "1/s^2", "integral gain", 0.0, 60.0);
    v("MPC_XY_VEL_D_ACC", MPC_XY_VEL_D_ACC, "", "derivative gain, on the measured acceleration", 0.0, 10.0);
    v("MPC_Z_VEL_P_ACC", MPC_Z_VEL_P_ACC, "1/s", "vertical velocity error to acceleration setpoint", 0.0, 20.0);
    v("MPC_Z_VEL_I_ACC", MPC_Z_VEL_I_ACC, "1/s^2", "integral gain", 0.0, 60.0);
    v("MPC_Z_VEL_D_ACC", MPC_Z_VEL_D_ACC, "", "derivative gain, on the measured acceleration", 0.0, 10.0);
    v("MPC_XY_VEL_MAX", MPC_XY_VEL_MAX, "m/s", "largest horizontal velocity setpoint", 0.1, 30.0);
    v("MPC_Z_VEL_MAX_UP", MPC_Z_VEL_MAX_UP, "m/s", "largest velocity setpoint upwards", 0.1, 10.0);
    v("MPC_Z_VEL_MAX_DN", MPC_Z_VEL_MAX_DN, "m/s", "largest velocity setpoint downwards", 0.1, 10.0);
    v("MPC_TILTMAX_AIR", MPC_TILTMAX_AIR, "deg", "largest tilt setpoint", 5.0, 89.0);
    v("MPC_THR_HOVER", MPC_THR_HOVER, "", "hover thrust as a share of full thrust", 0.05, 0.9);
    v("MPC_THR_MIN", MPC_THR_MIN, "", "smallest share of full thrust in flight", 0.0, 0.5);
    v("MPC_THR_MAX", MPC_THR_MAX, "", "largest share of full thrust", 0.1, 1.0);
    v("MPC_VELD_LP", MPC_VELD_LP, "Hz", "low-pass cutoff of the acceleration for the derivative gains", 0.1, 50.0);
  }
};

struct AttitudeControlOptions {
  double MC_ROLL_P = 6.5, MC_PITCH_P = 6.5, MC_YAW_P = 2.8, MC_YAW_WEIGHT = 0.4;
  double MC_ROLLRATE_MAX = 220, MC_PITCHRATE_MAX = 220, MC_YAWRATE_MAX = 200;

  template <class V>
  void visit(V&& v) {
    v("MC_ROLL_P", MC_ROLL_P, "1/s", "roll error to roll rate setpoint", 0.0, 24.0);
    v("MC_PITCH_P", MC_PITCH_P, "1/s", "pitch error to pitch rate setpoint", 0.0, 24.0);
    v("MC_YAW_P", MC_YAW_P, "1/s", "yaw error to yaw rate setpoint", 0.0, 10.0);
    v("MC_YAW_WEIGHT", MC_YAW_WEIGHT, "", "weight of yaw relative to roll and pitch", 0.0, 1.0);
    v("MC_ROLLRATE_MAX", MC_ROLLRATE_MAX, "deg/s", "largest roll rate setpoint", 1.0, 1800.0);
    v("MC_PITCHRATE_MAX", MC_PITCHRATE_MAX, "deg/s", "largest pitch rate setpoint", 1.0, 1800.0);
    v("MC_YAWRATE_MAX", MC_YAWRATE_MAX, "deg/s", "largest yaw rate setpoint", 1.0, 1800.0);
  }
};

struct RateControlOptions {
  double MC_ROLLRATE_P = 0.15, MC_ROLLRATE_I = 0.2, MC_ROLLRATE_D = 0.003, MC_ROLLRATE_FF = 0, MC_RR_INT_LIM = 0.3;
  double MC_PITCHRATE_P = 0.15, MC_PITCHRATE_I = 0.2, MC_PITCHRATE_D = 0.003, MC_PITCHRATE_FF = 0, MC_PR_INT_LIM = 0.3;
  double MC_YAWRATE_P = 0.2, MC_YAWRATE_I = 0.1, MC_YAWRATE_D = 0, MC_YAWRATE_FF = 0, MC_YR_INT_LIM = 0.3;
  double IMU_GYRO_CUTOFF = 40, IMU_DGYRO_CUTOFF = 30;

  template <class V>
  void visit(V&& v) {
    v("MC_ROLLRATE_P", MC_ROLLRATE_P, "s",
      "roll rate error to torque setpoint; torques are shares of the largest about that axis", 0.0, 2.0);
    v("MC_ROLLRATE_I", MC_ROLLRATE_I, "", "integral gain", 0.0, 5.0);
    v("MC_ROLLRATE_D", MC_ROLLRATE_D, "s^2", "derivative gain, on the measured angular acceleration", 0.0, 0.1);
    v("MC_ROLLRATE_FF", MC_ROLLRATE_FF, "s", "feed-forward of the rate setpoint", 0.0, 2.0);
    v("MC_RR_INT_LIM", MC_RR_INT_LIM, "", "limit of the integral term", 0.0, 1.0);
    v("MC_PITCHRATE_P", MC_PITCHRATE_P, "s", "pitch rate error to torque setpoint", 0.0, 2.0);
    v("MC_PITCHRATE_I", MC_PITCHRATE_I, "", "integral gain", 0.0, 5.0);
    v("MC_PITCHRATE_D", MC_PITCHRATE_D, "s^2", "derivative gain, on the measured angular acceleration", 0.0, 0.1);
    v("MC_PITCHRATE_FF", MC_PITCHRATE_FF, "s", "feed-forward of the rate setpoint", 0.0, 2.0);
    v("MC_PR_INT_LIM", MC_PR_INT_LIM, "", "limit of the integral term", 0.0, 1.0);
    v("MC_YAWRATE_P", MC_YAWRATE_P, "s", "yaw rate error to torque setpoint", 0.0, 2.0);
    v("MC_YAWRATE_I", MC_YAWRATE_I, "", "integral gain", 0.0, 5.0);
    v("MC_YAWRATE_D", MC_YAWRATE_D, "s^2", "derivative gain, on the measured angular acceleration", 0.0, 0.1);
    v("MC_YAWRATE_FF", MC_YAWRATE_FF, "s", "feed-forward of the rate setpoint", 0.0, 2.0);
    v("MC_YR_INT_LIM", MC_YR_INT_LIM, "", "limit of the integral term", 0.0, 1.0);
    v("IMU_GYRO_CUTOFF", IMU_GYRO_CUTOFF, "Hz", "low-pass cutoff of the angular rate, second-order Butterworth", 1.0, 1000.0);
    v("IMU_DGYRO_CUTOFF", IMU_DGYRO_CUTOFF, "Hz", "low-pass cutoff of the angular acceleration, first order", 1.0, 1000.0);
  }
};

struct ControlOptions {
  PositionControlOptions position;
  AttitudeControlOptions attitude;
  RateControlOptions rate;
  double THR_MDL_FAC = 1;

  template <class V>
  void visit(V&& v) {
    v.group("position", position, "position and velocity");
    v.group("attitude", attitude, "attitude");
    v.group("rate", rate, "angular rate");
    v("THR_MDL_FAC", THR_MDL_FAC, "", "thrust = fac * command^2 + (1 - fac) * command", 0.0, 1.0);
  }
};

}  // namespace fbvins
