// SPDX-License-Identifier: Apache-2.0
// A PX4 of its simulator's build (px4_sitl), run as a process that gets its sensors from here in lockstep: its time is that of
// the newest reading, and it waits for the next one. Loopback only. One owner.
//
//   Result<std::unique_ptr<Px4Process>> px4 = Px4Process::start(".../bin/px4", folder, parameters);
//   Result<void> done = (*px4)->step(sensor_message);    // returns with the answer
//   use((*px4)->controls());
#pragma once

#include <sys/types.h>

#include <array>
#include <memory>
#include <string>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/flight/px4_frames.hpp"
#include "fbvins/mavlink/wire.hpp"

namespace fbvins {

class Px4Process {
 public:
  /// `folder` exists already; what PX4 writes, and what it says in px4.log, stays there.
  static Result<std::unique_ptr<Px4Process>> start(const std::string& binary, const std::string& folder,
                                                   const Px4Parameters& parameters);
  Px4Process(const Px4Process&) = delete;
  Px4Process& operator=(const Px4Process&) = delete;
  ~Px4Process();

  Result<void> step(const HilSensorMessage& reading);
  /// Of its outputs, 0 to 1, or 0 where it is not armed.
  const std::array<float, 16>& controls() const { return controls_; }
  /// Its modules run.
  bool awake() const { return awake_; }
  int system_id() const { return instance_ + 1; }
  /// Where its link for companions listens.
  std::uint16_t companion_port() const;

 private:
  Px4Process(int instance, std::string folder) : instance_(instance), folder_(std::move(folder)) {}
  Result<void> launch(const std::string& binary, const Px4Parameters& parameters);
  Result<void> accept_simulator(const FileDescriptor& listener);
  Error ended() const;

  int instance_;
  std::string folder_;
  pid_t pid_ = -1;
  FileDescriptor simulator_;
  MavlinkDecoder decoder_;
  std::array<float, 16> controls_{};
  std::uint8_t sequence_ = 0;
  bool awake_ = false;
};

}  // namespace fbvins
