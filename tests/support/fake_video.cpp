// SPDX-License-Identifier: Apache-2.0
#include "tests/support/fake_video.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdarg>
#include <deque>
#include <map>
#include <mutex>
#include <string_view>

namespace fbvins {

struct FakeVideo::State {
  std::vector<std::uint32_t> formats;
  std::uint32_t most_width = 0;
  v4l2_pix_format format{};
  int fd = -1;
  bool streaming = false, plugged = true, tells_time = true, damaged = false;
  std::vector<void*> memory;
  std::deque<std::uint32_t> given;  // buffers that may be filled
  std::deque<v4l2_buffer> filled;
};

namespace {

constexpr std::uint32_t kBufferBytes = 4 << 20;

struct Devices {
  std::mutex mutex;
  std::map<std::string, std::shared_ptr<FakeVideo::State>> by_path;
  std::map<int, std::shared_ptr<FakeVideo::State>> by_fd;
};
Devices& devices() {
  static Devices all;
  return all;
}

int fail(int error) {
  errno = error;
  return -1;
}

int enumerate(FakeVideo::State& s, v4l2_fmtdesc& d) {
  if (d.index >= s.formats.size()) return fail(EINVAL);
  d.pixelformat = s.formats[d.index];
  return 0;
}

int set_format(FakeVideo::State& s, v4l2_pix_format& pix) {
  const auto known = std::find(s.formats.begin(), s.formats.end(), pix.pixelformat);
  if (known == s.formats.end()) pix.pixelformat = s.formats.front();
  pix.width = std::min(pix.width, s.most_width);
  const bool two = pix.pixelformat == V4L2_PIX_FMT_YUYV || pix.pixelformat == V4L2_PIX_FMT_UYVY;
  pix.bytesperline = pix.width * (two ? 2 : 1) + 32;  // drivers round up
  s.format = pix;
  return 0;
}

int dequeue(FakeVideo::State& s, v4l2_buffer& buffer) {
  if (!s.plugged) return fail(ENODEV);
  if (s.filled.empty()) return fail(EAGAIN);
  buffer = s.filled.front();
  s.filled.pop_front();
  std::uint64_t one = 0;
  [[maybe_unused]] const auto taken = ::read(s.fd, &one, sizeof(one));
  return 0;
}

int answer(FakeVideo::State& s, unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_QUERYCAP:
      static_cast<v4l2_capability*>(argument)->capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      return 0;
    case VIDIOC_ENUM_FMT: return enumerate(s, *static_cast<v4l2_fmtdesc*>(argument));
    case VIDIOC_S_FMT: return set_format(s, static_cast<v4l2_format*>(argument)->fmt.pix);
    case VIDIOC_REQBUFS: s.memory.resize(static_cast<v4l2_requestbuffers*>(argument)->count); return 0;
    case VIDIOC_QUERYBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      buffer.length = kBufferBytes;
      buffer.m.offset = buffer.index * kBufferBytes;
      return 0;
    }
    case VIDIOC_QBUF: s.given.push_back(static_cast<v4l2_buffer*>(argument)->index); return s.plugged ? 0 : fail(ENODEV);
    case VIDIOC_DQBUF: return dequeue(s, *static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON: s.streaming = true; return 0;
    default: return fail(ENOTTY);
  }
}

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

FakeVideo::FakeVideo(const std::string& path, std::vector<std::uint32_t> formats, int most_width_px)
    : state_(std::make_shared<State>()) {
  state_->formats = std::move(formats);
  state_->most_width = static_cast<std::uint32_t>(most_width_px);
  const std::lock_guard lock(devices().mutex);
  devices().by_path[path] = state_;
}

FakeVideo::~FakeVideo() {
  const std::lock_guard lock(devices().mutex);
  std::erase_if(devices().by_path, [&](const auto& entry) { return entry.second == state_; });
  state_->plugged = false;
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto woken = ::write(state_->fd, &one, sizeof(one));
}

bool FakeVideo::deliver(Time t, std::span<const std::uint8_t> bytes) {
  const std::lock_guard lock(devices().mutex);
  State& s = *state_;
  if (!s.streaming || s.given.empty()) return false;
  v4l2_buffer buffer{};
  buffer.index = s.given.front();
  s.given.pop_front();
  std::copy(bytes.begin(), bytes.end(), static_cast<std::uint8_t*>(s.memory[buffer.index]));
  buffer.bytesused = static_cast<std::uint32_t>(bytes.size());
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.timestamp = {t.ns / 1'000'000'000, t.ns % 1'000'000'000 / 1000};
  buffer.flags = (s.tells_time ? V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC : 0) | (s.damaged ? V4L2_BUF_FLAG_ERROR : 0);
  s.damaged = false;
  s.filled.push_back(buffer);
  const std::uint64_t one = 1;
  return ::write(s.fd, &one, sizeof(one)) == sizeof(one);
}

void FakeVideo::say_no_time() {
  const std::lock_guard lock(devices().mutex);
  state_->tells_time = false;
}

void FakeVideo::damage_next() {
  const std::lock_guard lock(devices().mutex);
  state_->damaged = true;
}

bool FakeVideo::streams() const {
  const std::lock_guard lock(devices().mutex);
  return state_->streaming;
}

}  // namespace fbvins

extern "C" {

int open(const char* path, int flags, ...) {
  using fbvins::devices;
  if (std::string_view(path).starts_with("/fake/")) {
    const std::lock_guard lock(devices().mutex);
    const auto device = devices().by_path.find(path);
    if (device == devices().by_path.end()) return fbvins::fail(ENOENT);
    fbvins::FakeVideo::State& s = *device->second;
    s.fd = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC | EFD_SEMAPHORE);
    s.given.clear(), s.filled.clear();
    devices().by_fd[s.fd] = device->second;
    return s.fd;
  }
  va_list arguments;
  va_start(arguments, flags);
  const auto mode = va_arg(arguments, mode_t);
  va_end(arguments);
  return fbvins::next<int (*)(const char*, int, ...)>("open")(path, flags, mode);
}

int ioctl(int fd, unsigned long request, ...) noexcept {
  using fbvins::devices;
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  {
    const std::lock_guard lock(devices().mutex);
    const auto device = devices().by_fd.find(fd);
    if (device != devices().by_fd.end() && device->second->fd == fd) return fbvins::answer(*device->second, request, argument);
  }
  return fbvins::next<int (*)(int, unsigned long, ...)>("ioctl")(fd, request, argument);
}

void* mmap(void* address, size_t length, int protection, int flags, int fd, off_t offset) noexcept {
  using fbvins::devices;
  const auto real = fbvins::next<void* (*)(void*, size_t, int, int, int, off_t)>("mmap");
  if (fd < 0) return real(address, length, protection, flags, fd, offset);
  const std::lock_guard lock(devices().mutex);
  const auto device = devices().by_fd.find(fd);
  if (device == devices().by_fd.end() || device->second->fd != fd) return real(address, length, protection, flags, fd, offset);
  void* memory = real(nullptr, length, protection, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  device->second->memory[static_cast<std::size_t>(offset) / fbvins::kBufferBytes] = memory;
  return memory;
}

}  // extern "C"
