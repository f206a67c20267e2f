// SPDX-License-Identifier: Apache-2.0
// A mission in closed loop: rotors move the vehicle, its sensors measure that, the odometry estimates the pose, and the
// autopilot flies by that pose. Simulated time waits for the odometry: the same setup gives the same bits on any machine,
// with one thread or several.
//
//   Result<FlightLog> flight = fly(setup, [](double t_s, FlightMode mode) { ... });
//
// With a real flight controller behind its simulator interface simulated time waits for that, too, but PX4's threads make results
// differ between runs. With a wall rate nothing waits: sensor data go through a socket into a live system, and estimates arrive
// when they are ready. Only the log contains the truth. In it, L is the true mission frame: the vehicle's true pose before
// take-off.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/flight/autopilot.hpp"
#include "fbvins/flight/collision.hpp"
#include "fbvins/flight/controller_program.hpp"
#include "fbvins/flight/estimator_link.hpp"
#include "fbvins/live/live_options.hpp"
#include "fbvins/sim/barometer.hpp"
#include "fbvins/sim/euroc_writer.hpp"
#include "fbvins/sim/simulation.hpp"
#include "fbvins/sim/wind.hpp"

namespace fbvins {

struct FlightSetup {
  Mission mission;
  SimulationOptions simulation;  ///< world, light, cameras, IMU, seed; its flight is not used
  QuadrotorOptions vehicle;
  ControlOptions control;
  WindOptions wind;
  BarometerModelOptions barometer;
  EstimatorSetup estimator;
  double estimate_delay_s = 0.03;   ///< latency: from an image to its pose in the controller
  double mounting_error_deg = 0.2;  ///< standard deviation on each axis; unknown to the autopilot
  std::string recording;            ///< folder for a recording; empty: none
  ControllerProgram controller;     ///< which one flies
  double wall_rate = 0;             ///< simulated seconds per second of wall time; 0: simulated time waits for the odometry
  LiveOptions live;                 ///< with a wall rate
};

/// State at one IMU reading.
struct FlightRow {
  double t_s = 0;
  Pose<Local, BodyFlu> truth;
  Vec3 true_velocity = Vec3::Zero();  ///< m/s, in L
  AutopilotOutput autopilot;
  PerRotor rotor_radps{};
  double battery_V = 0;
};

struct FlightLog {
  Pose<W, BodyFlu> start;  ///< true pose before take-off, in the world
  std::vector<FlightRow> rows;
  std::vector<Odometry> odometry;  ///< in order of arrival
  SimulatedImu imu;                ///< samples, and truth in the world frame
  FlightMode mode = FlightMode::waiting;
  FlightReason reason = FlightReason::none;
  std::optional<std::string> crash;  ///< one sentence
  bool out_of_time = false;
  int images = 0;
  std::vector<ControllerEvent> events;  ///< of a real flight controller: its messages and what it did
  int controller_resets = 0;            ///< of its estimator, in flight
  std::optional<WallTime> wall_time;    ///< with a wall rate
};

Result<FlightLog> fly(const FlightSetup& setup, const std::function<void(double t_s, FlightMode mode)>& progress = {});

/// PX4's defaults with this vehicle's hover thrust and thrust curve, and stiffer position and velocity gains for indoors.
ControlOptions control_for(const QuadrotorOptions& vehicle);

/// T_VB: cameras forward, pitched down by `camera_pitch_deg`, as in simulated flights; the IMU 4 cm ahead of and 3 cm above V.
Pose<BodyFlu, B> imu_mounting(const StereoRig& rig, double camera_pitch_deg);

}  // namespace fbvins
