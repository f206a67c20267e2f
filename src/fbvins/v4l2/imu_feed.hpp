// SPDX-License-Identifier: Apache-2.0
// The IMU for cameras that have none: a flight controller's by MAVLink, or another process's by the socket. Readings are stamped
// on CLOCK_MONOTONIC, as images of video devices are.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/live/source.hpp"

namespace fbvins {

class ImuFeed {
 public:
  using Say = std::function<void(const std::string&)>;

  virtual ~ImuFeed() = default;
  /// Delivers until stop().
  virtual Result<void> run(SensorInput& input) = 0;
  virtual void stop() = 0;

  /// `udp:HOST:PORT[:OWN_PORT]` or `serial:DEVICE:BAUD`: MAVLink; `socket:PATH`: listens there (docs/socket.md) and ignores
  /// images. `rig`: with which a sender's hello must agree. `say` is called on the thread of run().
  static Result<std::unique_ptr<ImuFeed>> open(const std::string& where, const StereoRig& rig, Say say);
};

}  // namespace fbvins
