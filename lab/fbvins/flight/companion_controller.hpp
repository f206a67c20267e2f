// SPDX-License-Identifier: Apache-2.0
// A real flight controller in place of the autopilot: the companion's side, the same for all. The odometry is sent as `fbvins
// live` sends it (MavlinkSession), with the mission's setpoints and commands (CompanionMission); both directions are kept in
// link.tlog. How the flight controller's own sensors and its motor commands pass is Px4Controller's and ArduPilotController's.
// One owner.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/flight/companion_mission.hpp"
#include "fbvins/flight/controller_program.hpp"
#include "fbvins/flight/telemetry_log.hpp"
#include "fbvins/live/byte_link.hpp"
#include "fbvins/live/mavlink_session.hpp"
#include "fbvins/live/pose_propagator.hpp"

namespace fbvins {

/// Poses a second.
inline constexpr double kCompanionRate_hz = 50;

/// A real flight controller, connected.
Result<std::unique_ptr<FlightController>> start_controller(const ControllerProgram& program, const Mission& mission,
                                                           const ControlOptions& control, const QuadrotorOptions& vehicle,
                                                           const StereoRig& rig, const Pose<BodyFlu, B>& mounting);

class CompanionController : public FlightController {
 public:
  void add(const Odometry& odometry) override { propagator_.rebase(odometry); }
  void add(const MapUpdate& update) override { session_.take(update); }
  void add_barometer(double height_m) override { height_m_ = height_m; }
  Result<void> take(const ImuSample& reading) override;
  Result<void> take_board(const BoardReading& reading) override;

  double warm_up_s() const override { return warm_up_s_; }
  const PerRotor& commands() const override { return commands_; }
  const AutopilotOutput& output() const override { return mission_->output(); }
  std::vector<ControllerEvent> events() const override { return mission_->events(); }
  int resets_in_flight() const override { return mission_->resets_in_flight(); }

 protected:
  struct Link {
    UdpAddress address;
    MavlinkOptions options;
    double warm_up_s = 0;  ///< both synchronise their clocks before the flight begins
    double ahead_s = 0;    ///< the flight controller's clock at the beginning of the flight
  };
  CompanionController(const Link& link, std::unique_ptr<CompanionMission> mission, const StereoRig& rig);
  /// `folder`: for link.tlog.
  Result<void> open(const std::string& folder);

  /// Its own sensors, on its clock; sets commands_.
  virtual Result<void> step(const BoardReading& reading, double t_s) = 0;
  /// Something listens on its port.
  virtual bool awake() const { return true; }

  std::optional<double> height_m_;  ///< of the barometer, since the last step
  PerRotor commands_{};

 private:
  Time companion_time(double t_s) const;
  void send(const MavlinkSession::Frames& frames);
  void receive();

  ByteLink link_;
  MavlinkDecoder decoder_;
  MavlinkSession session_;
  PosePropagator propagator_;
  std::unique_ptr<CompanionMission> mission_;
  TelemetryLog log_;
  int system_id_;
  double warm_up_s_, ahead_s_;
  double now_s_ = 0;           ///< since the flight began
  std::optional<Time> first_;  ///< first reading of the odometry's IMU
  std::uint8_t sequence_ = 0;
};

}  // namespace fbvins
