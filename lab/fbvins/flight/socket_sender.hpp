// SPDX-License-Identifier: Apache-2.0
// Sends sensor data to a socket source (docs/socket.md) like a driver in another process, for a simulated vehicle. One owner.
//
//   Result<std::unique_ptr<SocketSender>> sender = SocketSender::connect("/run/fbvins/sensors.sock", rig);
//   (*sender)->send(reading);
//   (*sender)->send(frame);
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/live/socket_protocol.hpp"
#include "fbvins/types/aiding.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

class SocketSender {
 public:
  /// Sends HELLO with the rig and waits for WELCOME, ten seconds at most.
  static Result<std::unique_ptr<SocketSender>> connect(const std::string& path, const StereoRig& rig);
  SocketSender(const SocketSender&) = delete;
  SocketSender& operator=(const SocketSender&) = delete;
  ~SocketSender();

  Result<void> send(const ImuSample& reading);
  Result<void> send(const AidingSample& reading);
  /// Copies the images into shared memory. The frame is dropped if no slot is free.
  Result<void> send(const StereoFrame& frame);

 private:
  SocketSender(FileDescriptor connection, int width_px, int height_px);
  Result<void> greet(const StereoRig& rig);
  /// Handles one message of the source; false if none came in time.
  Result<bool> hear(int wait_ms);
  Result<void> put(const void* message, std::size_t size);

  FileDescriptor connection_;
  std::uint32_t width_px_, height_px_;
  std::uint8_t* slots_ = nullptr;
  std::uint64_t free_slots_ = 0, sequence_ = 0;
  bool welcome_ = false;
};

}  // namespace fbvins
