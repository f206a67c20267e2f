// SPDX-License-Identifier: Apache-2.0
// Parses and checks a sender's messages (fbvins/live/socket_protocol.hpp): any bytes give either a valid message or an error of
// one sentence. Pure functions, any thread.
//
//   Result<SocketMessage> message = parse_socket_message(bytes);
//   if (!message) return refuse(message.error());
//   if (const auto* frame = std::get_if<SocketFrame>(&*message)) ...
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/live/device_facts.hpp"
#include "fbvins/live/socket_protocol.hpp"
#include "fbvins/types/aiding.hpp"
#include "fbvins/types/anchor.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// Where the images lie in the shared memory.
struct FrameLayout {
  int width_px = 0, height_px = 0;
  int slots = 0;
  std::size_t slot_bytes = 0;
  int cameras = 2;
  std::array<std::size_t, kMostCameras> offset_bytes{};  ///< of each camera's image in a slot
  std::size_t depth_offset_bytes = 0;                    ///< of the depth image; 0: there is none
  int depth_width_px = 0, depth_height_px = 0;           ///< of the depth image, where there is one

  std::size_t image_bytes() const { return static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px); }
  std::size_t depth_values() const {
    return static_cast<std::size_t>(depth_width_px) * static_cast<std::size_t>(depth_height_px);
  }
  std::size_t bytes() const { return static_cast<std::size_t>(slots) * slot_bytes; }
};

/// A hello's calibration as sent, so that two can be compared.
struct SocketRig {
  FbvinsSocketRig pair{};
  int cameras = 2;
  std::array<FbvinsSocketCamera, kMostCameras - 2> more{};  ///< zeros beyond their count
  std::optional<FbvinsSocketDepth> depth = {};
  FbvinsSocketCamera depth_camera{};                                      ///< of a depth sensor that lies elsewhere
  int depth_width_px = 0, depth_height_px = 0;                            ///< of its images; 0: they are registered to the camera
  std::optional<std::array<FbvinsSocketTimes, kMostCameras>> times = {};  ///< none: all cameras have those of `pair`
  /// Coefficients of lenses that have more than four, of cameras 0, 1 ... and, last, of the depth sensor; none: no lens has.
  std::optional<std::array<std::array<double, 4>, kMostCameras + 1>> lenses = {};
  std::optional<FbvinsSocketImuAxes> axes = {};
};
bool same(const SocketRig& a, const SocketRig& b);

struct SocketHello {
  std::string name;  ///< printable
  int minor = 0;     ///< of the sender's version; its major one equals ours
  FrameLayout layout;
  std::optional<SocketRig> rig;
};

struct SocketImu {
  std::vector<ImuSample> readings;  ///< finite
  int refused = 0;                  ///< left out, not being finite
};

struct SocketFrame {
  Time t;
  std::uint64_t sequence = 0;
  int slot = 0;              ///< below FBVINS_SOCKET_MOST_SLOTS
  std::uint32_t images = 0;  ///< bit i: of camera i; FBVINS_SOCKET_DEPTH
  ExposureOffsets offsets = {};
};

struct SocketPosition {
  std::optional<Anchor> anchor;  ///< none: left out, being impossible
};

struct SocketAiding {
  std::optional<AidingSample> reading;  ///< none: left out, being impossible
};

struct SocketDevice {
  DeviceFacts facts;
};

struct SocketGoodbye {
  std::string text;  ///< printable
};

/// A type that this version does not have.
struct SocketUnknown {
  std::uint32_t type = 0;
};

using SocketMessage =
    std::variant<SocketHello, SocketImu, SocketFrame, SocketPosition, SocketAiding, SocketDevice, SocketGoodbye, SocketUnknown>;

/// ErrorCode::unsupported: another major version; ErrorCode::malformed: anything else.
Result<SocketMessage> parse_socket_message(std::span<const std::byte> bytes);

/// The rig of a hello, checked as calibration files are.
Result<StereoRig> parse_socket_rig(const SocketRig& rig, int width_px, int height_px);
/// The message of a reading, for our own senders and for tests.
FbvinsSocketAiding socket_aiding(const AidingSample& reading);
/// The reverse, for our own senders and for tests.
SocketRig socket_rig(const StereoRig& rig);
/// The calibration's fields and flags of a hello.
void put_rig(const SocketRig& rig, FbvinsSocketHello& hello);

}  // namespace fbvins
