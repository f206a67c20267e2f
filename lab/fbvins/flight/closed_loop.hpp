// SPDX-License-Identifier: Apache-2.0
// A mission flown on estimates: the vehicle moves as its rotors push it, its sensors see and feel that, the odometry makes a pose
// of it, and the autopilot flies by that pose. Simulated time waits for the odometry: the same setup gives the same bits on any
// machine, with one thread or several.
//
//   Result<FlightLog> flight = fly(setup, [](double t_s, FlightMode mode) { ... });
//
// With a real PX4 behind its simulator interface the same world waits for PX4, too; its threads make no promise about bits. With
// a rate of wall time nothing waits: sensor data go through a socket into a live system, and estimates come when they come. Truth
// goes to the log alone. L here is the true one: where the vehicle truly stood.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/flight/autopilot.hpp"
#include "fbvins/flight/collision.hpp"
#include "fbvins/flight/estimator_link.hpp"
#include "fbvins/flight/px4_controller.hpp"
#include "fbvins/live/live_options.hpp"
#include "fbvins/sim/barometer.hpp"
#include "fbvins/sim/euroc_writer.hpp"
#include "fbvins/sim/simulation.hpp"
#include "fbvins/sim/wind.hpp"

namespace fbvins {

struct FlightSetup {
  Mission mission;
  SimulationOptions simulation;  ///< world, light, cameras, IMU, seed; not its flight
  QuadrotorOptions vehicle;
  ControlOptions control;
  WindOptions wind;
  BarometerOptions barometer;
  EstimatorSetup estimator;
  double estimate_delay_s = 0.03;   ///< from an image to its pose in the controller
  double mounting_error_deg = 0.2;  ///< standard deviation on each axis, of what the autopilot does not know
  std::string recording;            ///< folder for a recording; empty: none
  Px4Setup px4;                     ///< flies instead of the autopilot, where it is named
  double wall_rate = 0;             ///< seconds of the flight in one of this machine's; 0: simulated time waits for the odometry
  LiveOptions live;                 ///< of wall time
};

/// One reading of the IMU.
struct FlightRow {
  double t_s = 0;
  Pose<Local, BodyFlu> truth;
  Vec3 true_velocity = Vec3::Zero();  ///< m/s, in L
  AutopilotOutput autopilot;
  PerRotor rotor_radps{};
  double battery_V = 0;
};

struct FlightLog {
  Pose<W, BodyFlu> start;  ///< where it stood, in the world
  std::vector<FlightRow> rows;
  std::vector<Odometry> odometry;  ///< as it became known
  SimulatedImu imu;                ///< readings, and truth in the world's frame
  FlightMode mode = FlightMode::waiting;
  FlightReason reason = FlightReason::none;
  std::optional<std::string> crash;  ///< one sentence
  bool out_of_time = false;
  int images = 0;
  std::vector<ControllerEvent> events;  ///< what another flight controller said and did
  int controller_resets = 0;            ///< of its estimator, in flight
  std::optional<WallTime> wall_time;    ///< of a flight in wall time
};

Result<FlightLog> fly(const FlightSetup& setup, const std::function<void(double t_s, FlightMode mode)>& progress = {});

/// PX4's defaults, with the hover thrust and the curve of thrust that this vehicle has.
ControlOptions control_for(const QuadrotorOptions& vehicle);

/// How the IMU is fixed to the vehicle: cameras forward and a little down, as simulated flights have it.
Pose<BodyFlu, B> imu_mounting(const StereoRig& rig, double camera_pitch_deg);

}  // namespace fbvins
