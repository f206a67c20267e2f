// SPDX-License-Identifier: Apache-2.0
// What flies a vehicle, as the closed loop sees it: odometry, readings and barometer in, four motors out. Where the vehicle truly
// is never comes near it. Two of them: Autopilot, and Px4Controller behind which a real PX4 flies.
#pragma once

#include <string>
#include <vector>

#include "fbvins/flight/controller.hpp"
#include "fbvins/flight/failsafe.hpp"
#include "fbvins/types/loop.hpp"

namespace fbvins {

/// What was made of one reading.
struct AutopilotOutput {
  Time t;
  FlightMode mode = FlightMode::waiting;
  FlightReason reason = FlightReason::none;
  Health health;              ///< the odometry's
  double estimate_age_s = 0;  ///< since the image of the newest estimate
  VehicleEstimate estimate;   ///< flown by
  PathSetpoint setpoint;
  ControlTrace control;
  std::size_t step = 0;  ///< of the mission
};

/// Of a flight controller with sensors of its own, in V at the centre of mass.
struct BoardReading {
  double t_s = 0;  ///< since the flight began; negative while it stands and warms up
  Vec3 accel = Vec3::Zero(), gyro = Vec3::Zero();
};

/// Something that a flight controller said or did.
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

  /// When it becomes known.
  virtual void add(const Odometry& odometry) = 0;
  /// Where W is in the map, where there is one.
  virtual void add(const MapUpdate& update) = 0;
  virtual void add_barometer(double height_m) = 0;
  /// Of the odometry's IMU, as it comes.
  virtual Result<void> take(const ImuSample& reading) = 0;

  /// 0: it has no IMU of its own, and flies by the odometry's.
  virtual double board_rate_hz() const { return 0; }
  /// So long its own sensors are read before the flight begins.
  virtual double warm_up_s() const { return 0; }
  virtual Result<void> take_board(const BoardReading& /*reading*/) { return {}; }

  /// Until the next reading.
  virtual const PerRotor& commands() const = 0;
  virtual const AutopilotOutput& output() const = 0;
  virtual std::vector<ControllerEvent> events() const { return {}; }
  /// How often an estimator of its own moved its frame between arming and landing.
  virtual int resets_in_flight() const { return 0; }
};

}  // namespace fbvins
