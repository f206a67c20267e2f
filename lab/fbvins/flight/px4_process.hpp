// SPDX-License-Identifier: Apache-2.0
// Runs a px4_sitl build of PX4 as a process in lockstep: it gets its sensor data from here, its time is that of the newest
// reading, and it waits for the next one. Loopback only. One owner.
//
//   Result<std::unique_ptr<Px4Process>> px4 = Px4Process::start(".../bin/px4", folder, parameters);
//   Result<void> done = (*px4)->step(sensor_message);    // waits for the answer
//   use((*px4)->controls());
#pragma once

#include <array>
#include <memory>
#include <string>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/flight/child_process.hpp"
#include "fbvins/flight/px4_frames.hpp"
#include "fbvins/mavlink/wire.hpp"

namespace fbvins {

class Px4Process {
 public:
  /// `folder` must exist; PX4's files and its output, px4.log, stay there.
  static Result<std::unique_ptr<Px4Process>> start(const std::string& binary, const std::string& folder,
                                                   const Px4Parameters& parameters);
  Px4Process(const Px4Process&) = delete;
  Px4Process& operator=(const Px4Process&) = delete;

  Result<void> step(const HilSensorMessage& reading);
  /// Actuator outputs, 0 to 1; 0 while disarmed.
  const std::array<float, 16>& controls() const { return controls_; }
  /// Whether its modules run: it has answered.
  bool awake() const { return awake_; }
  int system_id() const { return instance_ + 1; }
  /// UDP port of its MAVLink instance for companions.
  std::uint16_t companion_port() const;

 private:
  Px4Process(int instance, std::string folder) : instance_(instance), folder_(std::move(folder)) {}
  Result<void> launch(const std::string& binary, const Px4Parameters& parameters);
  Result<void> accept_simulator(const FileDescriptor& listener);
  Error ended() const;

  int instance_;
  std::string folder_;
  ChildProcess child_;
  FileDescriptor simulator_;
  MavlinkDecoder decoder_;
  std::array<float, 16> controls_{};
  std::uint8_t sequence_ = 0;
  bool awake_ = false;
};

}  // namespace fbvins
