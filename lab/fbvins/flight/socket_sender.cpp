// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/socket_sender.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <utility>

#include "fbvins/live/socket_message.hpp"

namespace fbvins {
namespace {

constexpr std::uint32_t kSlots = 8;
constexpr int kWelcome_ms = 10'000;

Error failed(const std::string& what) {
  return {ErrorCode::unreadable, fmt::format("the sensors' socket: {}: {}", what, std::strerror(errno))};
}

}  // namespace

SocketSender::SocketSender(FileDescriptor connection, int width_px, int height_px)
    : connection_(std::move(connection)),
      width_px_(static_cast<std::uint32_t>(width_px)),
      height_px_(static_cast<std::uint32_t>(height_px)) {}

SocketSender::~SocketSender() {
  if (slots_ != nullptr) ::munmap(slots_, std::size_t{kSlots} * 2 * width_px_ * height_px_);
}

Result<std::unique_ptr<SocketSender>> SocketSender::connect(const std::string& path, const StereoRig& rig) {
  FileDescriptor connection(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path)) return Error{ErrorCode::unreadable, path + ": too long for a socket's name"};
  path.copy(address.sun_path, path.size());
  if (::connect(connection.number(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) return failed(path);
  std::unique_ptr<SocketSender> sender(new SocketSender(std::move(connection), rig.left().width(), rig.left().height()));
  if (Result<void> greeted = sender->greet(rig); !greeted) return greeted.error();
  return sender;
}

Result<void> SocketSender::greet(const StereoRig& rig) {
  const std::uint32_t image_bytes = width_px_ * height_px_;
  const std::size_t bytes = std::size_t{kSlots} * 2 * image_bytes;
  const FileDescriptor memory(::memfd_create("fbvins-fly", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!memory || ::ftruncate(memory.number(), static_cast<off_t>(bytes)) != 0 ||
      ::fcntl(memory.number(), F_ADD_SEALS, F_SEAL_SHRINK) != 0)
    return failed("memory for images");
  void* mapped = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, memory.number(), 0);
  if (mapped == MAP_FAILED) return failed("memory for images");
  slots_ = static_cast<std::uint8_t*>(mapped);
  free_slots_ = (std::uint64_t{1} << kSlots) - 1;

  FbvinsSocketHello hello{};
  hello.header = {FBVINS_SOCKET_HELLO, sizeof(hello)};
  std::memcpy(hello.magic, FBVINS_SOCKET_MAGIC, sizeof(hello.magic));
  hello.major = FBVINS_SOCKET_MAJOR, hello.minor = FBVINS_SOCKET_MINOR;
  std::strcpy(hello.name, "simulated vehicle");
  hello.width_px = width_px_, hello.height_px = height_px_;
  hello.slots = kSlots, hello.slot_bytes = 2 * image_bytes, hello.right_offset_bytes = image_bytes;
  put_rig(socket_rig(rig), hello);
  iovec place{&hello, sizeof(hello)};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  msghdr message{};
  message.msg_iov = &place, message.msg_iovlen = 1;
  message.msg_control = control, message.msg_controllen = sizeof(control);
  cmsghdr* with = CMSG_FIRSTHDR(&message);
  with->cmsg_level = SOL_SOCKET, with->cmsg_type = SCM_RIGHTS, with->cmsg_len = CMSG_LEN(sizeof(int));
  const int descriptor = memory.number();
  std::memcpy(CMSG_DATA(with), &descriptor, sizeof(descriptor));
  if (::sendmsg(connection_.number(), &message, MSG_NOSIGNAL) < 0) return failed("hello");
  while (!welcome_) {
    const Result<bool> heard = hear(kWelcome_ms);
    if (!heard) return heard.error();
    if (!*heard) return Error{ErrorCode::unreadable, "the sensors' socket: no welcome"};
  }
  return {};
}

Result<bool> SocketSender::hear(int wait_ms) {
  pollfd waiting{connection_.number(), POLLIN, 0};
  if (::poll(&waiting, 1, wait_ms) <= 0) return false;
  FbvinsSocketGoodbye message{};  // the longest message of a source
  const ssize_t got = ::recv(connection_.number(), &message, sizeof(message), 0);
  if (got < 0) return failed("the source is gone");
  if (got == 0) return Error{ErrorCode::unreadable, "the sensors' socket: the source has closed it"};
  switch (message.header.type) {
    case FBVINS_SOCKET_WELCOME: welcome_ = true; break;
    case FBVINS_SOCKET_RELEASED: {
      FbvinsSocketReleased released{};
      std::memcpy(&released, &message, sizeof(released));
      free_slots_ |= released.slots;
      break;
    }
    case FBVINS_SOCKET_GOODBYE:
      return Error{ErrorCode::unreadable, fmt::format("the sensors' socket: {}",
                                                      std::string(message.text, strnlen(message.text, sizeof(message.text))))};
    default: break;
  }
  return true;
}

Result<void> SocketSender::put(const void* message, std::size_t size) {
  if (::send(connection_.number(), message, size, MSG_NOSIGNAL) < 0) return failed("sending");
  return {};
}

Result<void> SocketSender::send(const ImuSample& reading) {
  struct OneReading {
    FbvinsSocketHeader header{FBVINS_SOCKET_IMU, sizeof(OneReading)};
    std::uint32_t count = 1, reserved = 0;
    FbvinsSocketReading reading{};
  } message;
  message.reading.t_ns = reading.t.ns;
  for (int i = 0; i < 3; ++i) {
    message.reading.gyro_radps[i] = reading.gyro_radps[i];
    message.reading.accel_mps2[i] = reading.accel_mps2[i];
  }
  return put(&message, sizeof(message));
}

Result<void> SocketSender::send(const AidingSample& reading) {
  const FbvinsSocketAiding message = socket_aiding(reading);
  return put(&message, sizeof(message));
}

Result<void> SocketSender::send(const StereoFrame& frame) {
  while (true) {
    const Result<bool> heard = hear(0);
    if (!heard) return heard.error();
    if (!*heard) break;
  }
  FbvinsSocketFrame message{{FBVINS_SOCKET_FRAME, sizeof(FbvinsSocketFrame)}, frame.t.ns, sequence_++, 0, 0, {}};
  if (free_slots_ == 0) return {};
  message.slot = static_cast<std::uint32_t>(std::countr_zero(free_slots_));
  const std::size_t image_bytes = std::size_t{width_px_} * height_px_;
  std::uint8_t* at = slots_ + message.slot * 2 * image_bytes;
  for (const auto& [image, flag] :
       {std::pair{frame.left().get(), FBVINS_SOCKET_LEFT}, {frame.right().get(), FBVINS_SOCKET_RIGHT}}) {
    if (image != nullptr) {
      for (int y = 0; y < image->height(); ++y)
        std::copy_n(image->row(y), image->width(), at + static_cast<std::size_t>(y) * width_px_);
      message.images |= flag;
    }
    at += image_bytes;
  }
  if (message.images == 0) return {};
  free_slots_ &= ~(std::uint64_t{1} << message.slot);
  return put(&message, sizeof(message));
}

}  // namespace fbvins
