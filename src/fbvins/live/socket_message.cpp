// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/socket_message.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "fbvins/core/overloaded.hpp"
#include "fbvins/geometry/so3.hpp"
#include "fbvins/io/image_decode.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kMostMemory_bytes = std::size_t{1} << 30U;
/// Stamps beyond this (146 years) could overflow in differences.
constexpr std::int64_t kLastStamp_ns = std::int64_t{1} << 62U;

constexpr auto kLargestSide_px = static_cast<std::uint32_t>(kLargestImageSide_px);

/// What the messages had in versions 1.1, 1.2, 1.3, 1.4 and 1.6, and with lenses.
constexpr std::size_t kFirstHello_bytes = offsetof(FbvinsSocketHello, cameras);
constexpr std::size_t kSecondHello_bytes = offsetof(FbvinsSocketHello, depth_offset_bytes);
constexpr std::size_t kThirdHello_bytes = offsetof(FbvinsSocketHello, times);
constexpr std::size_t kFourthHello_bytes = offsetof(FbvinsSocketHello, depth_width_px);
constexpr std::size_t kFifthHello_bytes = offsetof(FbvinsSocketHello, more_distortion);
constexpr std::size_t kSixthHello_bytes = offsetof(FbvinsSocketHello, imu_axes);
constexpr std::size_t kFirstFrame_bytes = offsetof(FbvinsSocketFrame, offset_ns);
/// Images of one frame lie closer together than this.
constexpr std::int64_t kLongestOffset_ns = 1'000'000'000;

static_assert(kFirstHello_bytes == 80 + sizeof(FbvinsSocketRig) && sizeof(FbvinsSocketRig) == 392);
static_assert(kSecondHello_bytes == kFirstHello_bytes + 32 + 6 * sizeof(FbvinsSocketCamera));
static_assert(kThirdHello_bytes == kSecondHello_bytes + 8 + sizeof(FbvinsSocketDepth) && sizeof(FbvinsSocketDepth) == 32);
static_assert(kFourthHello_bytes == kThirdHello_bytes + 8 * sizeof(FbvinsSocketTimes) && sizeof(FbvinsSocketTimes) == 16);
static_assert(kFifthHello_bytes == kFourthHello_bytes + 8 + sizeof(FbvinsSocketCamera));
static_assert(kSixthHello_bytes == kFifthHello_bytes + 9 * 32 && sizeof(FbvinsSocketImuAxes) == 264);
static_assert(sizeof(FbvinsSocketHello) == kSixthHello_bytes + sizeof(FbvinsSocketImuAxes));
static_assert(FBVINS_SOCKET_DEPTH == 1 << kMostCameras);
static_assert(sizeof(FbvinsSocketReading) == 56 && kFirstFrame_bytes == 32 && sizeof(FbvinsSocketFrame) == 96);
static_assert(sizeof(FbvinsSocketGoodbye) == 256 && int{FBVINS_SOCKET_MOST_CAMERAS} == kMostCameras);
static_assert(sizeof(FbvinsSocketPosition) == 120 && sizeof(FbvinsSocketTag) == 304 && sizeof(FbvinsSocketDevice) == 2048);
static_assert(sizeof(FbvinsSocketAiding) == 144);
static_assert(sizeof(FbvinsSocketImu) <= FBVINS_SOCKET_LARGEST_MESSAGE);

Error malformed(std::string sentence) { return {ErrorCode::malformed, std::move(sentence)}; }

/// The message as its struct; an error where it is shorter. What is longer is of a later version.
template <class Struct>
Result<Struct> read(std::span<const std::byte> bytes, const char* name, std::size_t size = sizeof(Struct)) {
  if (bytes.size() < size) return malformed(fmt::format("{} of {} bytes where {} are needed", name, bytes.size(), size));
  Struct out{};
  std::memcpy(&out, bytes.data(), size);
  return out;
}

bool is_stamp(std::int64_t t_ns) { return t_ns >= 0 && t_ns < kLastStamp_ns; }

/// Untrusted text, made safe for a terminal.
template <std::size_t size>
std::string printable(const char (&text)[size]) {
  std::string out(text, strnlen(text, size));
  for (char& c : out)
    if (c < ' ' || c > '~') c = '?';
  return out;
}

/// Where there is one, the depth image has a place of its own behind the camera's image.
Result<void> place_depth(const FbvinsSocketHello& hello, FrameLayout& layout) {
  if ((hello.flags & FBVINS_SOCKET_HAS_DEPTH) == 0) return {};
  if (layout.cameras != 1)
    return malformed(fmt::format("hello: a depth sensor goes with one camera, and there are {}", layout.cameras));
  layout.depth_width_px = layout.width_px, layout.depth_height_px = layout.height_px;
  if ((hello.flags & FBVINS_SOCKET_HAS_DEPTH_CAMERA) != 0) {
    const std::uint32_t width = hello.depth_width_px, height = hello.depth_height_px;
    if (width < 1 || height < 1 || width > kLargestSide_px || height > kLargestSide_px)
      return malformed(fmt::format("hello: depth images of {} x {} pixels", width, height));
    layout.depth_width_px = static_cast<int>(width), layout.depth_height_px = static_cast<int>(height);
  }
  const std::size_t at = hello.depth_offset_bytes, size = 2 * layout.depth_values();
  if (at < layout.image_bytes() || at % 2 != 0 || layout.slot_bytes % 2 != 0 || layout.slot_bytes < at + size)
    return malformed(
        fmt::format("hello: a depth image of {} bytes at {} does not fit into a slot of {} bytes", size, at, layout.slot_bytes));
  layout.depth_offset_bytes = at;
  return {};
}

Result<FrameLayout> layout_of(const FbvinsSocketHello& hello) {
  if (hello.width_px < 1 || hello.height_px < 1 || hello.width_px > kLargestSide_px || hello.height_px > kLargestSide_px)
    return malformed(fmt::format("hello: images of {} x {} pixels", hello.width_px, hello.height_px));
  if (hello.slots < 2 || hello.slots > FBVINS_SOCKET_MOST_SLOTS)
    return malformed(fmt::format("hello: {} slots, not 2 to {}", hello.slots, int{FBVINS_SOCKET_MOST_SLOTS}));
  FrameLayout layout{static_cast<int>(hello.width_px), static_cast<int>(hello.height_px), static_cast<int>(hello.slots),
                     hello.slot_bytes};
  if ((hello.flags & FBVINS_SOCKET_HAS_CAMERAS) != 0) {
    if (hello.cameras < 1 || hello.cameras > FBVINS_SOCKET_MOST_CAMERAS)
      return malformed(fmt::format("hello: {} cameras, not 1 to {}", hello.cameras, int{FBVINS_SOCKET_MOST_CAMERAS}));
    layout.cameras = static_cast<int>(hello.cameras);
  }
  layout.offset_bytes[1] = hello.right_offset_bytes;
  std::copy_n(hello.more_offset_bytes, kMostCameras - 2, layout.offset_bytes.begin() + 2);
  if (layout.slot_bytes < layout.image_bytes())
    return malformed(
        fmt::format("hello: an image of {} bytes does not fit into a slot of {} bytes", layout.image_bytes(), layout.slot_bytes));
  for (int i = 1; i < layout.cameras; ++i) {
    const std::size_t at = layout.offset_bytes[static_cast<std::size_t>(i)];
    if (at < layout.image_bytes() || layout.slot_bytes < at + layout.image_bytes())
      return malformed(fmt::format("hello: {} images of {} bytes, that of camera {} at {}, do not fit into a slot of {} bytes",
                                   layout.cameras, layout.image_bytes(), i, at, layout.slot_bytes));
  }
  if (Result<void> placed = place_depth(hello, layout); !placed) return placed.error();
  if (layout.bytes() > kMostMemory_bytes) return malformed(fmt::format("hello: {} bytes of images, over 1 GiB", layout.bytes()));
  return layout;
}

/// Up to the last field that is filled.
std::size_t size_of_hello(std::uint32_t flags) {
  if ((flags & FBVINS_SOCKET_HAS_IMU_AXES) != 0) return sizeof(FbvinsSocketHello);
  if ((flags & FBVINS_SOCKET_HAS_LENSES) != 0) return kSixthHello_bytes;
  if ((flags & FBVINS_SOCKET_HAS_DEPTH_CAMERA) != 0) return kFifthHello_bytes;
  if ((flags & FBVINS_SOCKET_HAS_TIMES) != 0) return kFourthHello_bytes;
  if ((flags & FBVINS_SOCKET_HAS_DEPTH) != 0) return kThirdHello_bytes;
  return (flags & FBVINS_SOCKET_HAS_CAMERAS) != 0 ? kSecondHello_bytes : kFirstHello_bytes;
}

Result<SocketMessage> parse_hello(std::span<const std::byte> bytes) {
  // The version is at the same place in every version, and is checked before what depends on it.
  constexpr std::size_t kUpToVersion = offsetof(FbvinsSocketHello, flags);
  const auto version = read<FbvinsSocketHello>(bytes, "hello", kUpToVersion);
  if (!version) return version.error();
  if (std::memcmp(version->magic, FBVINS_SOCKET_MAGIC, sizeof(version->magic)) != 0)
    return malformed("hello: not an FB-VINS sender");
  if (version->major != FBVINS_SOCKET_MAJOR)
    return Error{ErrorCode::unsupported,
                 fmt::format("the sender speaks version {}.{} of the protocol, this program {}.{}", version->major,
                             version->minor, int{FBVINS_SOCKET_MAJOR}, int{FBVINS_SOCKET_MINOR})};
  auto hello = read<FbvinsSocketHello>(bytes, "hello", kFirstHello_bytes);
  if (hello) hello = read<FbvinsSocketHello>(bytes, "hello", size_of_hello(hello->flags));
  if (!hello) return hello.error();
  const auto layout = layout_of(*hello);
  if (!layout) return layout.error();
  SocketHello out{printable(hello->name), hello->minor, *layout, std::nullopt};
  if ((hello->flags & FBVINS_SOCKET_HAS_RIG) == 0) return SocketMessage(std::move(out));
  out.rig = SocketRig{hello->rig, layout->cameras};
  std::copy_n(hello->more, std::max(0, layout->cameras - 2), out.rig->more.begin());
  if (layout->depth_offset_bytes > 0) {
    out.rig->depth = hello->depth;
    if ((hello->flags & FBVINS_SOCKET_HAS_DEPTH_CAMERA) != 0) {
      out.rig->depth_camera = hello->depth_camera;
      out.rig->depth_width_px = layout->depth_width_px, out.rig->depth_height_px = layout->depth_height_px;
    }
  }
  if ((hello->flags & FBVINS_SOCKET_HAS_TIMES) != 0) out.rig->times = std::to_array(hello->times);
  if ((hello->flags & FBVINS_SOCKET_HAS_LENSES) != 0) {
    auto& lenses = out.rig->lenses.emplace();
    for (std::size_t i = 0; i < lenses.size(); ++i) lenses[i] = std::to_array(hello->more_distortion[i]);
  }
  if ((hello->flags & FBVINS_SOCKET_HAS_IMU_AXES) != 0) out.rig->axes = hello->imu_axes;
  const auto rig = parse_socket_rig(*out.rig, layout->width_px, layout->height_px);
  if (!rig) return rig.error();
  return SocketMessage(std::move(out));
}

Result<SocketMessage> parse_imu(std::span<const std::byte> bytes) {
  constexpr std::size_t kBefore = offsetof(FbvinsSocketImu, readings);
  const auto head = read<FbvinsSocketImu>(bytes, "imu", kBefore);
  if (!head) return head.error();
  if (head->count > FBVINS_SOCKET_MOST_READINGS || bytes.size() < kBefore + head->count * sizeof(FbvinsSocketReading))
    return malformed(fmt::format("imu: {} readings in {} bytes", head->count, bytes.size()));
  SocketImu out;
  out.readings.reserve(head->count);
  for (std::size_t i = 0; i < head->count; ++i) {
    FbvinsSocketReading reading;
    std::memcpy(&reading, bytes.data() + kBefore + i * sizeof(reading), sizeof(reading));
    if (!is_stamp(reading.t_ns)) return malformed(fmt::format("imu: stamp {} ns", reading.t_ns));
    const ImuSample sample{{reading.t_ns}, Vec3(reading.gyro_radps), Vec3(reading.accel_mps2)};
    if (sample.gyro_radps.allFinite() && sample.accel_mps2.allFinite()) out.readings.push_back(sample);
    else ++out.refused;
  }
  return SocketMessage(std::move(out));
}

Result<SocketMessage> parse_frame(std::span<const std::byte> bytes) {
  const bool with_offsets = bytes.size() >= sizeof(FbvinsSocketFrame);
  const auto frame = read<FbvinsSocketFrame>(bytes, "frame", with_offsets ? sizeof(FbvinsSocketFrame) : kFirstFrame_bytes);
  if (!frame) return frame.error();
  if (!is_stamp(frame->t_ns)) return malformed(fmt::format("frame: stamp {} ns", frame->t_ns));
  if (frame->slot >= FBVINS_SOCKET_MOST_SLOTS) return malformed(fmt::format("frame: no slot {}", frame->slot));
  if (frame->images == 0) return malformed("frame: without an image");
  SocketFrame out{{frame->t_ns}, frame->sequence, static_cast<int>(frame->slot), frame->images};
  for (int i = 0; i < kMostCameras; ++i) {
    const std::int64_t offset_ns = frame->offset_ns[i];
    if (offset_ns < -kLongestOffset_ns || offset_ns > kLongestOffset_ns)
      return malformed(fmt::format("frame: camera {} took its image {} ns from the stamp", i, offset_ns));
    if (offset_ns != 0) out.offsets.set(i, Duration{offset_ns});
  }
  return SocketMessage(std::move(out));
}

Result<SocketMessage> parse_position(std::span<const std::byte> bytes) {
  const auto position = read<FbvinsSocketPosition>(bytes, "position");
  if (!position) return position.error();
  if (!is_stamp(position->t_ns)) return malformed(fmt::format("position: stamp {} ns", position->t_ns));
  const auto& c = position->covariance_m2;
  Anchor anchor;
  if (position->measured == FBVINS_SOCKET_HEIGHT) {
    anchor = HeightAnchor{{position->t_ns}, position->p_A[2], std::sqrt(c[5]), Vec3(position->p_B)};
  } else if (position->measured == FBVINS_SOCKET_WHERE) {
    Mat3 covariance;
    covariance << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
    anchor = PositionAnchor{{position->t_ns}, Vec3(position->p_A), covariance, Vec3(position->p_B)};
  } else {
    return malformed(fmt::format("position: measured is {}, not 0 or 1", position->measured));
  }
  return SocketMessage(impossible(anchor).empty() ? SocketPosition{std::move(anchor)} : SocketPosition{});
}

template <class From, class To>
Pose<From, To> pose_of(const double (&p)[3], const double (&q)[4]) {
  return {Quat(q[0], q[1], q[2], q[3]), Vec3(p)};
}

Result<SocketMessage> parse_tag(std::span<const std::byte> bytes) {
  const auto tag = read<FbvinsSocketTag>(bytes, "tag");
  if (!tag) return tag.error();
  if (!is_stamp(tag->t_ns)) return malformed(fmt::format("tag: stamp {} ns", tag->t_ns));
  TagAnchor out{.t = {tag->t_ns},
                .id = static_cast<int>(tag->id & 0x7fffffffu),
                .T_AT = tag->has_place != 0 ? pose_of<A, Tag>(tag->p_AT, tag->q_AT) : unknown_place(),
                .T_BT = pose_of<B, Tag>(tag->p_BT, tag->q_BT)};
  for (int i = 0, n = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) out.covariance(i, j) = out.covariance(j, i) = tag->covariance_BT[n++];
  const Anchor anchor = out;
  const bool usable = impossible(anchor).empty() && out.has_place() == (tag->has_place != 0);
  return SocketMessage(usable ? SocketPosition{anchor} : SocketPosition{});
}

Result<SocketMessage> parse_aiding(std::span<const std::byte> bytes) {
  const auto m = read<FbvinsSocketAiding>(bytes, "aiding");
  if (!m) return m.error();
  if (!is_stamp(m->t_ns)) return malformed(fmt::format("aiding: stamp {} ns", m->t_ns));
  const Time t{m->t_ns};
  AidingSample reading;
  const Quat q_BS(m->q_BS[0], m->q_BS[1], m->q_BS[2], m->q_BS[3]);
  if (m->sensor == FBVINS_SOCKET_RANGE)
    reading = RangeSample{t, m->value[0], m->sigma[0], Vec3(m->p_BS), q_BS * Vec3::UnitX(), m->nearest_m, m->farthest_m};
  else if (m->sensor == FBVINS_SOCKET_VELOCITY) reading = VelocitySample{t, Vec3(m->value), Vec3(m->sigma), Vec3(m->p_BS), q_BS};
  else if (m->sensor == FBVINS_SOCKET_PRESSURE) reading = PressureSample{t, m->value[0], m->sigma[0]};
  else return malformed(fmt::format("aiding: sensor is {}, not 0 to 2", m->sensor));
  return SocketMessage(impossible(reading).empty() ? SocketAiding{std::move(reading)} : SocketAiding{});
}

Result<SocketMessage> parse_device(std::span<const std::byte> bytes) {
  const auto device = read<FbvinsSocketDevice>(bytes, "device");
  if (!device) return device.error();
  auto facts = parse_device_facts(std::string_view(device->text, strnlen(device->text, sizeof(device->text))));
  if (!facts) return facts.error();
  return SocketMessage(SocketDevice{*std::move(facts)});
}

Result<SocketMessage> parse_goodbye(std::span<const std::byte> bytes) {
  const auto goodbye = read<FbvinsSocketGoodbye>(bytes, "goodbye");
  if (!goodbye) return goodbye.error();
  return SocketMessage(SocketGoodbye{printable(goodbye->text)});
}

}  // namespace

FbvinsSocketAiding socket_aiding(const AidingSample& reading) {
  FbvinsSocketAiding m{};
  m.header = {FBVINS_SOCKET_AIDING, sizeof(m)};
  m.t_ns = stamp_of(reading).ns;
  const auto put = [](const auto& from, auto& to) { std::copy(from.data(), from.data() + from.size(), to); };
  const auto put_place = [&](const Vec3& p, const Quat& q) {
    put(p, m.p_BS);
    const Eigen::Vector4d wxyz(q.w(), q.x(), q.y(), q.z());
    put(wxyz, m.q_BS);
  };
  std::visit(Overloaded{[&](const RangeSample& r) {
                          m.sensor = FBVINS_SOCKET_RANGE, m.value[0] = r.distance_m, m.sigma[0] = r.sigma_m;
                          put_place(r.p_B, so3_between(Vec3::UnitX(), r.direction_B));
                          m.nearest_m = r.nearest_m, m.farthest_m = r.farthest_m;
                        },
                        [&](const VelocitySample& r) {
                          m.sensor = FBVINS_SOCKET_VELOCITY;
                          put(r.v_mps, m.value), put(r.sigma_mps, m.sigma);
                          put_place(r.p_B, r.q_BS);
                        },
                        [&](const PressureSample& r) {
                          m.sensor = FBVINS_SOCKET_PRESSURE, m.value[0] = r.pressure_pa, m.sigma[0] = r.sigma_pa;
                        }},
             reading);
  return m;
}

Result<SocketMessage> parse_socket_message(std::span<const std::byte> bytes) {
  const auto header = read<FbvinsSocketHeader>(bytes, "a message");
  if (!header) return header.error();
  if (header->size_bytes != bytes.size())
    return malformed(fmt::format("a message of {} bytes says that it has {}", bytes.size(), header->size_bytes));
  switch (header->type) {
    case FBVINS_SOCKET_HELLO: return parse_hello(bytes);
    case FBVINS_SOCKET_IMU: return parse_imu(bytes);
    case FBVINS_SOCKET_FRAME: return parse_frame(bytes);
    case FBVINS_SOCKET_GOODBYE: return parse_goodbye(bytes);
    case FBVINS_SOCKET_POSITION: return parse_position(bytes);
    case FBVINS_SOCKET_TAG: return parse_tag(bytes);
    case FBVINS_SOCKET_AIDING: return parse_aiding(bytes);
    case FBVINS_SOCKET_DEVICE: return parse_device(bytes);
    default: return SocketMessage(SocketUnknown{header->type});
  }
}

}  // namespace fbvins
