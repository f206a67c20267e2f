// SPDX-License-Identifier: Apache-2.0
// The messages of a sender of sensor data (fbvins/live/socket_protocol.hpp), as a fuzz target.
#include <cstring>
#include <span>

#include "fbvins/live/socket_message.hpp"
#include "tests/fuzz/fuzz_targets.hpp"
#include "tests/fuzz/require.hpp"

namespace fbvins::fuzz {
namespace {

template <class Struct>
std::string bytes_of(std::uint32_t type, Struct message, std::size_t size = sizeof(Struct)) {
  message.header = {type, static_cast<std::uint32_t>(size)};
  return {reinterpret_cast<const char*>(&message), size};
}

SocketRig seed_rig() {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{40, 41, 31.5, 23.5, -0.25, 0.0625}, 64, 48), {}});
  rig.cameras[1].T_BC.p.x() = 0.125;
  return socket_rig(rig);
}

/// Makes the size in the message agree with the bytes: mutations change it, and a message that contradicts its size
/// would be refused at once.
std::string with_its_size(std::string_view bytes) {
  std::string out(bytes);
  const auto size = static_cast<std::uint32_t>(out.size());
  if (out.size() >= sizeof(FbvinsSocketHeader))
    out.replace(offsetof(FbvinsSocketHeader, size_bytes), sizeof(size), reinterpret_cast<const char*>(&size), sizeof(size));
  return out;
}

void check(const SocketHello& hello) {
  const FrameLayout& layout = hello.layout;
  require(layout.slots >= 2 && layout.slots <= FBVINS_SOCKET_MOST_SLOTS && layout.bytes() <= (std::size_t{1} << 30U));
  require(layout.cameras >= 1 && layout.cameras <= kMostCameras && layout.image_bytes() <= layout.slot_bytes);
  for (int i = 1; i < layout.cameras; ++i) {
    const std::size_t at = layout.offset_bytes[static_cast<std::size_t>(i)];
    require(at >= layout.image_bytes() && at + layout.image_bytes() <= layout.slot_bytes);
  }
  if (layout.depth_offset_bytes > 0)
    require(layout.cameras == 1 && layout.depth_offset_bytes >= layout.image_bytes() && layout.depth_values() > 0 &&
            layout.depth_offset_bytes + 2 * layout.depth_values() <= layout.slot_bytes);
  if (hello.rig) require(parse_socket_rig(*hello.rig, layout.width_px, layout.height_px).ok());
}

void check(const SocketImu& imu) {
  for (const ImuSample& sample : imu.readings) require(sample.gyro_radps.allFinite() && sample.accel_mps2.allFinite());
}

void check(const SocketFrame& frame) {
  require(frame.t.ns >= 0 && frame.slot >= 0 && frame.slot < FBVINS_SOCKET_MOST_SLOTS && frame.images != 0);
}

void check(const SocketPosition& position) { require(!position.anchor || impossible(*position.anchor).empty()); }
void check(const SocketAiding& aiding) { require(!aiding.reading || impossible(*aiding.reading).empty()); }
void check(const SocketDevice& device) {
  for (const SensorFinding& finding : device_findings(device.facts, *parse_socket_rig(seed_rig(), 64, 48)))
    require(!finding.text.empty() && finding.text.find('\n') == std::string::npos);
}
void check(const SocketGoodbye& goodbye) { require(goodbye.text.find('\n') == std::string::npos); }
void check(const SocketUnknown&) {}

}  // namespace

std::vector<std::string> socket_seeds() {
  FbvinsSocketHello hello{};
  std::strcpy(hello.magic, FBVINS_SOCKET_MAGIC), std::strcpy(hello.name, "seed");
  hello.major = 1, hello.flags = FBVINS_SOCKET_HAS_RIG, hello.rig = seed_rig().pair;
  hello.width_px = 64, hello.height_px = 48, hello.slots = 4, hello.slot_bytes = 8192, hello.right_offset_bytes = 4096;
  FbvinsSocketHello three = hello;
  three.flags |= FBVINS_SOCKET_HAS_CAMERAS;
  three.minor = 2, three.cameras = 3, three.slot_bytes = 12288, three.more_offset_bytes[0] = 8192;
  three.more[0] = three.rig.left;
  three.more[0].T_BC[7] = 0.25;
  FbvinsSocketHello depth = hello;
  depth.flags |= FBVINS_SOCKET_HAS_CAMERAS | FBVINS_SOCKET_HAS_DEPTH | FBVINS_SOCKET_HAS_DEPTH_CAMERA;
  depth.minor = 6, depth.cameras = 1, depth.slot_bytes = 12288, depth.depth_offset_bytes = 4096;
  depth.depth = {0.003, 0.2, 8, 0.005};
  depth.depth_width_px = 64, depth.depth_height_px = 48, depth.depth_camera = depth.rig.left;
  FbvinsSocketHello lenses = hello;
  lenses.flags |= FBVINS_SOCKET_HAS_LENSES | FBVINS_SOCKET_HAS_IMU_AXES;
  lenses.minor = 8, lenses.rig.left.model = FBVINS_SOCKET_RADTAN5, lenses.rig.right.model = FBVINS_SOCKET_RATIONAL;
  lenses.more_distortion[0][0] = 0.01, lenses.more_distortion[1][3] = 0.001;
  for (const int i : {0, 4, 8}) lenses.imu_axes.gyro[i] = lenses.imu_axes.accel[i] = 1;
  FbvinsSocketImu imu{{}, 3, 0, {}};
  for (int i = 0; i < 3; ++i) imu.readings[i] = {100 + i, {0.1, 0.2, 0.3}, {0, 0, 9.81}};
  return {
      bytes_of(FBVINS_SOCKET_HELLO, hello),
      bytes_of(FBVINS_SOCKET_HELLO, three),
      bytes_of(FBVINS_SOCKET_HELLO, depth),
      bytes_of(FBVINS_SOCKET_HELLO, lenses),
      bytes_of(FBVINS_SOCKET_IMU, imu, offsetof(FbvinsSocketImu, readings) + 3 * sizeof(FbvinsSocketReading)),
      bytes_of(FBVINS_SOCKET_FRAME, FbvinsSocketFrame{{}, 42, 7, 3, FBVINS_SOCKET_LEFT | FBVINS_SOCKET_RIGHT, {}}),
      bytes_of(FBVINS_SOCKET_POSITION, FbvinsSocketPosition{{}, 42, {1, 2, 3}, {0.01, 0, 0, 0.01, 0, 0.01}, {0, 0, 0.1}, 0, 0}),
      bytes_of(FBVINS_SOCKET_AIDING, socket_aiding(VelocitySample{.t = Time{42}})),
      bytes_of(FBVINS_SOCKET_AIDING, socket_aiding(RangeSample{.t = Time{42}, .distance_m = 2})),
      bytes_of(FBVINS_SOCKET_DEVICE, FbvinsSocketDevice{{}, "firmware=5.13.0.50\nusb=2.1\nexposure_ms=4\nstalls=1\n"}),
      bytes_of(FBVINS_SOCKET_GOODBYE, FbvinsSocketGoodbye{{}, FBVINS_SOCKET_DONE, 0, "done"})};
}

void fuzz_socket(std::string_view bytes) {
  const std::string whole = with_its_size(bytes);
  const auto message = parse_socket_message(std::as_bytes(std::span(whole)));
  if (message) std::visit([](const auto& m) { check(m); }, *message);
  else require(!message.error().message.empty() && message.error().message.find('\n') == std::string::npos);
}

}  // namespace fbvins::fuzz
