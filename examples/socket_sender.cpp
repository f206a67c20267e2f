// SPDX-License-Identifier: Apache-2.0
// Plays a EuRoC folder as if it were sensors: a sender for `fbvins live --source socket:PATH`. It needs one header of FB-VINS.
//   g++ -std=c++20 -O2 -I include examples/socket_sender.cpp -lpng -o socket_sender && ./socket_sender PATH MH_01_easy/mav0
#include <fcntl.h>
#include <png.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <thread>

#include "euroc_rig.hpp"  // put your calibration here

static const uint32_t kWidth = 752, kHeight = 480, kImageBytes = kWidth * kHeight, kSlotBytes = 2 * kImageBytes, kSlots = 16;
static const int64_t kPair_ns = 1000000;  // stamps of a pair
static const int connection = socket(AF_UNIX, SOCK_SEQPACKET, 0);

static void need(bool fact, const char* what) {
  if (!fact) std::perror(what), std::exit(1);
}
template <class Message>
static void send_message(uint32_t type, Message& message, size_t size = sizeof(Message), msghdr with = {}) {
  message.header = {type, static_cast<uint32_t>(size)};
  iovec bytes{&message, size};
  with.msg_iov = &bytes, with.msg_iovlen = 1;
  need(sendmsg(connection, &with, MSG_NOSIGNAL) >= 0, "the estimator is gone");
}
/// Receives a message of the estimator: slots that are free again, or a goodbye.
static bool hear(uint64_t& free_slots, int flags) {
  FbvinsSocketGoodbye message{};  // the longest of its messages
  const bool heard = recv(connection, &message, sizeof(message), flags) > 0;
  if (message.header.type == FBVINS_SOCKET_RELEASED) free_slots |= reinterpret_cast<FbvinsSocketReleased&>(message).slots;
  if (message.header.type == FBVINS_SOCKET_GOODBYE) std::fprintf(stderr, "goodbye: %s\n", message.text), std::exit(1);
  return heard;
}
static bool read_png(const std::string& path, uint8_t* pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&image, path.c_str())) return false;
  image.format = PNG_FORMAT_GRAY;
  return PNG_IMAGE_SIZE(image) == kImageBytes && png_image_finish_read(&image, nullptr, pixels, 0, nullptr);
}

int main(int argc, char** argv) {
  need(argc == 3, "usage: socket_sender SOCKET EUROC_FOLDER");
  sockaddr_un address{AF_UNIX, {}};
  std::strncpy(address.sun_path, argv[1], sizeof(address.sun_path) - 1);
  need(connect(connection, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0, argv[1]);

  const int memory = memfd_create("images", MFD_ALLOW_SEALING);  // the hello carries it
  need(ftruncate(memory, kSlots * kSlotBytes) == 0 && fcntl(memory, F_ADD_SEALS, F_SEAL_SHRINK) == 0, "memory");
  auto* slots = static_cast<uint8_t*>(mmap(nullptr, kSlots * kSlotBytes, PROT_READ | PROT_WRITE, MAP_SHARED, memory, 0));
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  *reinterpret_cast<cmsghdr*>(control) = {CMSG_LEN(sizeof(int)), SOL_SOCKET, SCM_RIGHTS};
  std::memcpy(CMSG_DATA(reinterpret_cast<cmsghdr*>(control)), &memory, sizeof(memory));
  msghdr with{};
  with.msg_control = control, with.msg_controllen = sizeof(control);
  FbvinsSocketHello hello{};
  std::strcpy(hello.magic, FBVINS_SOCKET_MAGIC), std::strcpy(hello.name, "EuRoC player");
  hello.major = FBVINS_SOCKET_MAJOR, hello.minor = FBVINS_SOCKET_MINOR, hello.flags = FBVINS_SOCKET_HAS_RIG;
  hello.width_px = kWidth, hello.height_px = kHeight, hello.slots = kSlots, hello.slot_bytes = kSlotBytes;
  hello.right_offset_bytes = kImageBytes, hello.rig = kEurocRig;
  send_message(FBVINS_SOCKET_HELLO, hello, sizeof(hello), with);
  uint64_t free_slots = (uint64_t{1} << kSlots) - 1;
  need(hear(free_slots, 0), "no welcome");

  const std::string folder = argv[2];
  std::ifstream readings(folder + "/imu0/data.csv"), images(folder + "/cam0/data.csv"), right_images(folder + "/cam1/data.csv");
  FbvinsSocketFrame frame{};
  int64_t right_ns = 0;
  readings.ignore(1000, '\n'), images.ignore(1000, '\n') >> frame.t_ns, right_images.ignore(1000, '\n') >> right_ns;
  const auto start = std::chrono::steady_clock::now() + std::chrono::seconds(1) - std::chrono::nanoseconds(frame.t_ns);
  const auto wait_until = [&](int64_t t_ns) { std::this_thread::sleep_until(start + std::chrono::nanoseconds(t_ns)); };
  std::thread imu_thread([&] {  // as in a device: readings do not wait for images
    FbvinsSocketImu imu{{}, 1, 0, {}};
    auto& [t_ns, w, f] = imu.readings[0];
    for (char c = 0; readings >> t_ns >> c >> w[0] >> c >> w[1] >> c >> w[2] >> c >> f[0] >> c >> f[1] >> c >> f[2];)
      wait_until(t_ns), send_message(FBVINS_SOCKET_IMU, imu, offsetof(FbvinsSocketImu, readings) + sizeof(imu.readings[0]));
  });
  for (; images; images.ignore(1000, '\n') >> frame.t_ns, ++frame.sequence) {
    while (hear(free_slots, MSG_DONTWAIT)) continue;
    if (free_slots == 0) continue;  // the gap in `sequence` tells the estimator of the frame
    frame.slot = static_cast<uint32_t>(__builtin_ctzll(free_slots));
    uint8_t* slot = slots + frame.slot * kSlotBytes;
    while (right_images && right_ns < frame.t_ns - kPair_ns) right_images.ignore(1000, '\n') >> right_ns;
    frame.images = read_png(folder + "/cam0/data/" + std::to_string(frame.t_ns) + ".png", slot) * FBVINS_SOCKET_LEFT;
    if (right_ns <= frame.t_ns + kPair_ns)
      frame.images +=
          read_png(folder + "/cam1/data/" + std::to_string(right_ns) + ".png", slot + kImageBytes) * FBVINS_SOCKET_RIGHT;
    if (frame.images == 0) continue;
    wait_until(frame.t_ns);
    free_slots &= ~(uint64_t{1} << frame.slot);
    send_message(FBVINS_SOCKET_FRAME, frame);
  }
  imu_thread.join();
  FbvinsSocketGoodbye goodbye{{}, FBVINS_SOCKET_DONE, 0, "end of the recording"};
  send_message(FBVINS_SOCKET_GOODBYE, goodbye);
}
