// SPDX-License-Identifier: Apache-2.0
// A real PX4 in place of the autopilot. It gets the same inputs as on a vehicle: its board's IMU and barometer in lockstep
// (HIL_SENSOR), and over UDP the odometry, as `fbvins live` sends it, with the mission's setpoints and commands. It returns the
// motor commands (HIL_ACTUATOR_CONTROLS). One owner.
//
//   Result<std::unique_ptr<Px4Controller>> px4 = Px4Controller::create(setup, mission, control, vehicle, rig, mounting);
#pragma once

#include <memory>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/flight/px4_mission.hpp"
#include "fbvins/flight/px4_process.hpp"
#include "fbvins/live/byte_link.hpp"
#include "fbvins/live/mavlink_session.hpp"
#include "fbvins/live/pose_propagator.hpp"

namespace fbvins {

struct Px4Setup {
  std::string binary;  ///< bin/px4 of a px4_sitl build; empty: no PX4
  std::string folder;  ///< for its parameters and logs; deleted and created at the start
};

class Px4Controller final : public FlightController {
 public:
  static Result<std::unique_ptr<FlightController>> create(const Px4Setup& setup, const Mission& mission,
                                                          const ControlOptions& control, const QuadrotorOptions& vehicle,
                                                          const StereoRig& rig, const Pose<BodyFlu, B>& mounting);

  void add(const Odometry& odometry) override { propagator_.rebase(odometry); }
  /// PX4 flies in W.
  void add(const MapUpdate&) override {}
  void add_barometer(double height_m) override { height_m_ = height_m; }
  Result<void> take(const ImuSample& reading) override;

  double board_rate_hz() const override { return 250; }  ///< as in PX4's simulators
  double warm_up_s() const override { return kWarmUp_s; }
  Result<void> take_board(const BoardReading& reading) override;

  const PerRotor& commands() const override { return commands_; }
  const AutopilotOutput& output() const override { return mission_.output(); }
  std::vector<ControllerEvent> events() const override { return mission_.events(); }
  int resets_in_flight() const override { return mission_.resets_in_flight(); }

 private:
  /// PX4 uses its estimate of the companion's clock offset after 500 TIMESYNC answers, at 10 Hz.
  static constexpr double kWarmUp_s = 56;

  Px4Controller(std::unique_ptr<Px4Process> px4, MavlinkOptions options, const Mission& mission, const StereoRig& rig);
  void receive();
  /// The companion's clock.
  Time companion_time(double t_s) const;
  void send(const MavlinkSession::Frames& frames);

  std::unique_ptr<Px4Process> px4_;
  ByteLink link_;
  MavlinkDecoder decoder_;
  MavlinkSession session_;
  PosePropagator propagator_;
  Px4Mission mission_;
  std::optional<double> height_m_;
  PerRotor commands_{};
  double now_s_ = 0;           ///< since the flight began
  std::optional<Time> first_;  ///< first reading of the odometry's IMU
  std::uint8_t sequence_ = 0;
};

}  // namespace fbvins
