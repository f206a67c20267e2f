// SPDX-License-Identifier: Apache-2.0
// For tests: a sender that follows the protocol or breaks it, and a rig for it.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/live/socket_message.hpp"

namespace fbvins::test {

inline constexpr int kWidth = 64, kHeight = 48, kSlots = 4;
inline constexpr std::uint32_t kImageBytes = kWidth * kHeight, kSlotBytes = 2 * 4096;

/// Numbers that binary fractions hold exactly, with a rotation that is not the identity.
inline StereoRig socket_test_rig() {
  StereoRig rig;
  rig.cameras.resize(2);
  rig.cameras[0].camera = Camera(PinholeRadtan{40, 41, 31.5, 23.5, -0.25, 0.0625, 0.001, -0.002}, kWidth, kHeight);
  rig.cameras[1].camera = Camera(PinholeRadtan{42, 43, 32.5, 22.5, -0.125, 0.03125, 0, 0}, kWidth, kHeight);
  rig.cameras[0].T_BC = {Quat(0.5, -0.5, 0.5, -0.5), Vec3(0.25, 0, 0.125)};
  rig.cameras[1].T_BC = {Quat(0.5, -0.5, 0.5, -0.5), Vec3(0.25, -0.125, 0.125)};
  rig.time_offset_s = 0.0078125;
  return rig;
}

inline FbvinsSocketHello hello_message(const StereoRig* rig) {
  FbvinsSocketHello hello{};
  hello.header = {FBVINS_SOCKET_HELLO, sizeof(hello)};
  std::memcpy(hello.magic, FBVINS_SOCKET_MAGIC, sizeof(hello.magic));
  hello.major = FBVINS_SOCKET_MAJOR;
  hello.minor = FBVINS_SOCKET_MINOR;
  std::strcpy(hello.name, "tester");
  hello.width_px = kWidth;
  hello.height_px = kHeight;
  hello.slots = kSlots;
  hello.slot_bytes = kSlotBytes;
  hello.right_offset_bytes = kSlotBytes / 2;
  if (!rig) return hello;
  put_rig(socket_rig(*rig), hello);
  return hello;
}

template <class Struct>
std::span<const std::byte> bytes_of(const Struct& message, std::size_t size = sizeof(Struct)) {
  return std::span(reinterpret_cast<const std::byte*>(&message), size);
}

/// A memfd for the slots.
inline FileDescriptor test_memory(std::size_t bytes = kSlots * kSlotBytes, int seals = F_SEAL_SHRINK) {
  FileDescriptor memory(::memfd_create("frames", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  EXPECT_EQ(::ftruncate(memory.number(), static_cast<off_t>(bytes)), 0);
  EXPECT_EQ(::fcntl(memory.number(), F_ADD_SEALS, seals), 0);
  return memory;
}

class TestSender {
 public:
  explicit TestSender(const std::string& path) : connection_(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    connected_ = ::connect(connection_.number(), reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  }
  bool connected() const { return connected_; }

  void send(std::span<const std::byte> bytes, int descriptor = -1, int copies = 1) {
    iovec place{const_cast<std::byte*>(bytes.data()), bytes.size()};
    alignas(cmsghdr) char control[CMSG_SPACE(8 * sizeof(int))] = {};
    msghdr header{};
    header.msg_iov = &place;
    header.msg_iovlen = 1;
    if (descriptor >= 0) {
      header.msg_control = control;
      header.msg_controllen = CMSG_SPACE(copies * sizeof(int));
      cmsghdr* c = CMSG_FIRSTHDR(&header);
      c->cmsg_level = SOL_SOCKET;
      c->cmsg_type = SCM_RIGHTS;
      c->cmsg_len = CMSG_LEN(copies * sizeof(int));
      for (int i = 0; i < copies; ++i) reinterpret_cast<int*>(CMSG_DATA(c))[i] = descriptor;
    }
    ::sendmsg(connection_.number(), &header, MSG_NOSIGNAL);
  }

  /// Memory and hello, as they should be; then waits for the answer's type.
  std::uint32_t begin(const StereoRig* rig = nullptr) {
    memory_ = test_memory();
    slots_ =
        static_cast<std::uint8_t*>(::mmap(nullptr, kSlots * kSlotBytes, PROT_READ | PROT_WRITE, MAP_SHARED, memory_.number(), 0));
    send(bytes_of(hello_message(rig)), memory_.number());
    return answer();
  }
  ~TestSender() {
    if (slots_) ::munmap(slots_, kSlots * kSlotBytes);
  }
  TestSender(TestSender&&) = delete;

  std::uint8_t* slot(std::uint32_t k) { return slots_ + k * kSlotBytes; }
  void send_frame(std::int64_t t_ns, std::uint32_t slot, std::uint64_t sequence,
                  std::uint32_t images = FBVINS_SOCKET_LEFT | FBVINS_SOCKET_RIGHT) {
    send(bytes_of(FbvinsSocketFrame{{FBVINS_SOCKET_FRAME, sizeof(FbvinsSocketFrame)}, t_ns, sequence, slot, images, {}}));
  }
  void send_readings(std::span<const FbvinsSocketReading> readings) {
    FbvinsSocketImu imu{};
    const std::size_t size = offsetof(FbvinsSocketImu, readings) + readings.size_bytes();
    imu.header = {FBVINS_SOCKET_IMU, static_cast<std::uint32_t>(size)};
    imu.count = static_cast<std::uint32_t>(readings.size());
    std::copy(readings.begin(), readings.end(), imu.readings);
    send(bytes_of(imu, size));
  }

  /// The next message of the estimator, within ten seconds; empty where the connection is over.
  std::vector<std::byte> receive() {
    std::vector<std::byte> bytes(FBVINS_SOCKET_LARGEST_MESSAGE);
    pollfd watched{connection_.number(), POLLIN, 0};
    if (::poll(&watched, 1, 10'000) <= 0) return {};
    ssize_t size = ::recv(connection_.number(), bytes.data(), bytes.size(), 0);
    if (size < 0) size = ::recv(connection_.number(), bytes.data(), bytes.size(), MSG_DONTWAIT);  // the goodbye behind an error
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
    return bytes;
  }
  /// The type of the next message that is no status; 0 where the connection is over.
  std::uint32_t answer() {
    do {
      last_ = receive();
    } while (type() == FBVINS_SOCKET_STATUS);
    return type();
  }
  template <class Struct>
  Struct last() const {
    Struct out{};
    std::memcpy(&out, last_.data(), std::min(last_.size(), sizeof(out)));
    return out;
  }

 private:
  std::uint32_t type() const { return last_.empty() ? 0 : last<FbvinsSocketHeader>().type; }

  FileDescriptor connection_, memory_;
  bool connected_ = false;
  std::uint8_t* slots_ = nullptr;
  std::vector<std::byte> last_;
};

/// A folder of its own for sockets, removed at the end.
class SocketFolder {
 public:
  SocketFolder() {
    char name[] = "/tmp/fbvins-socket-XXXXXX";
    if (const char* made = ::mkdtemp(name)) folder_ = made;
  }
  ~SocketFolder() { std::filesystem::remove_all(folder_); }
  std::string path() const { return folder_ + "/sensors.sock"; }

 private:
  std::string folder_;
};

}  // namespace fbvins::test
