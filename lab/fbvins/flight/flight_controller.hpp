// SPDX-License-Identifier: Apache-2.0
// Interface of a flight controller to the closed loop: odometry, IMU and barometer in, four motor commands out, without access
// to the true state. Implemented by Autopilot, and by Px4Controller and ArduPilotController, which
// connect real ones.
#pragma once

#include <string>
#include <vector>

#include "fbvins/flight/controller.hpp"
#include "fbvins/flight/failsafe.hpp"
#include "fbvins/types/loop.hpp"

namespace fbvins {

/// State of the controller after one IMU reading.
struct AutopilotOutput {
  Time t;
  FlightMode mode = FlightMode::waiting;
  FlightReason reason = FlightReason::none;
  Health health;              ///< the odometry's
  double estimate_age_s = 0;  ///< since the image of the newest estimate
  VehicleEstimate estimate;   ///< used for control
  PathSetpoint setpoint;
  ControlTrace control;
  std::size_t step = 0;  ///< index in the mission
};

/// IMU reading of a flight controller's board, in V at the centre of mass, SI units.
struct BoardReading {
  double t_s = 0;  ///< since the flight began; negative during warm-up
  Vec3 accel = Vec3::Zero(), gyro = Vec3::Zero();
};

/// A message or an action of a flight controller.
struct ControllerEvent {
  double t_s = 0;  ///< since the flight began
  std::string text;
};

class FlightController {
 public:
  FlightController() = default;
  FlightController(const FlightController&) = delete;
  FlightController& operator=(const FlightController&) = delete;
  virtual ~FlightController() = default;

  /// When an estimate becomes available.
  virtual void add(const Odometry& odometry) = 0;
  /// T_MW, if there is a map.
  virtual void add(const MapUpdate& update) = 0;
  virtual void add_barometer(double height_m) = 0;
  /// A reading of the odometry's IMU.
  virtual Result<void> take(const ImuSample& reading) = 0;

  /// Rate of its own IMU; 0: it has none and uses the odometry's.
  virtual double board_rate_hz() const { return 0; }
  /// For this long its own sensors are read before the flight begins.
  virtual double warm_up_s() const { return 0; }
  virtual Result<void> take_board(const BoardReading& /*reading*/) { return {}; }

  /// Motor commands until the next reading.
  virtual const PerRotor& commands() const = 0;
  virtual const AutopilotOutput& output() const = 0;
  virtual std::vector<ControllerEvent> events() const { return {}; }
  /// How often its own estimator reset between arming and landing.
  virtual int resets_in_flight() const { return 0; }
};

}  // namespace fbvins
