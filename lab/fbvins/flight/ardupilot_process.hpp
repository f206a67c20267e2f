// SPDX-License-Identifier: Apache-2.0
// Runs a SITL build of ArduPilot's Copter as a process in lockstep, by its interface for simulators that answer in JSON: it sends
// the servos' pulses and waits for the next sensor data, and its time is theirs. It gets an IMU and a barometer; nothing that
// it is sent contains the true pose. Loopback only. One owner.
//
//   Result<std::unique_ptr<ArduPilotProcess>> ap = ArduPilotProcess::start(".../arducopter", folder, parameters);
//   Result<void> done = (*ap)->step(t_s, reading, height_m);    // waits for the answer
//   use((*ap)->commands());
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "fbvins/flight/child_process.hpp"
#include "fbvins/flight/flight_controller.hpp"
#include "fbvins/flight/loopback_port.hpp"

namespace fbvins {

using ArduPilotParameters = std::vector<std::pair<std::string, std::string>>;
/// No GPS, no compass, vision as in docs/px4.md, this vehicle's thrust curve.
ArduPilotParameters ardupilot_parameters(const QuadrotorOptions& vehicle);

class ArduPilotProcess {
 public:
  static constexpr int kSystemId = 1;

  /// `folder` must exist; its parameters, its files and its output, ardupilot.log, stay there.
  static Result<std::unique_ptr<ArduPilotProcess>> start(const std::string& binary, const std::string& folder,
                                                         const ArduPilotParameters& parameters);
  ArduPilotProcess(const ArduPilotProcess&) = delete;
  ArduPilotProcess& operator=(const ArduPilotProcess&) = delete;

  /// `t_s`: on its clock, from 0 on. `height_m`: as the barometer measures it.
  Result<void> step(double t_s, const BoardReading& reading, double height_m);
  /// Shares of full pulse, 0 to 1; 0 while disarmed. Same order of rotors as here.
  const PerRotor& commands() const { return commands_; }
  /// UDP port to which its MAVLink is sent.
  std::uint16_t companion_port() const { return companion_port_; }

 private:
  explicit ArduPilotProcess(std::string folder) : folder_(std::move(folder)) {}
  Result<void> launch(const std::string& binary, const ArduPilotParameters& parameters);
  Result<void> take_pulses();

  std::string folder_;
  FileDescriptor simulator_;
  std::uint16_t companion_port_ = 0;
  sockaddr_in peer_{};
  ChildProcess child_;
  PerRotor commands_{};
};

}  // namespace fbvins
