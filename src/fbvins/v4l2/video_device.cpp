// SPDX-License-Identifier: Apache-2.0
#include "fbvins/v4l2/video_device.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "fbvins/live/host_clock.hpp"

namespace fbvins {
namespace {

constexpr std::uint32_t kBuffers = 4;

/// ioctl(); false: errno says why.
template <class Argument>
bool ask(int fd, unsigned long request, Argument& argument) {
  int answer = 0;
  do {
    answer = ::ioctl(fd, request, &argument);
  } while (answer < 0 && errno == EINTR);
  return answer == 0;
}

std::vector<std::uint32_t> formats_of(int fd) {
  std::vector<std::uint32_t> formats;
  v4l2_fmtdesc description{};
  description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  for (; ask(fd, VIDIOC_ENUM_FMT, description); ++description.index) formats.push_back(description.pixelformat);
  return formats;
}

std::string names_of(const std::vector<std::uint32_t>& formats) {
  std::string names;
  for (const std::uint32_t format : formats) names += (names.empty() ? "" : ", ") + fourcc_name(format);
  return names.empty() ? "none" : names;
}

v4l2_buffer capture_buffer(std::uint32_t index = 0) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

}  // namespace

VideoDevice::Buffer::Buffer(Buffer&& other) noexcept : data_(std::exchange(other.data_, nullptr)), size_(other.size_) {}
VideoDevice::Buffer& VideoDevice::Buffer::operator=(Buffer&& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  return *this;
}
VideoDevice::Buffer::~Buffer() {
  if (data_ != nullptr) ::munmap(data_, size_);
}
std::span<const std::uint8_t> VideoDevice::Buffer::bytes(std::size_t used) const {
  return {static_cast<const std::uint8_t*>(data_), std::min(used, size_)};
}

Error VideoDevice::error(const std::string& what) const {
  return {ErrorCode::unreadable, fmt::format("{}: {}: {}", path_, what, std::strerror(errno))};
}

Result<VideoDevice> VideoDevice::open(const std::string& path, int width_px, int height_px) {
  VideoDevice device(FileDescriptor(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)), path);
  if (!device.descriptor_) return device.error("cannot be opened");
  if (Result<void> chosen = device.choose_format(width_px, height_px); !chosen) return chosen.error();
  if (Result<void> mapped = device.map_buffers(); !mapped) return mapped.error();
  if (Result<void> begun = device.begin(); !begun) return begun.error();
  return device;
}

Result<void> VideoDevice::choose_format(int width_px, int height_px) {
  v4l2_capability capability{};
  if (!ask(fd(), VIDIOC_QUERYCAP, capability)) return error("is no video device");
  const std::uint32_t can =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0)
    return Error{ErrorCode::unsupported, path_ + ": delivers no images (V4L2 capture with streaming)"};
  const std::vector<std::uint32_t> offered = formats_of(fd());
  const auto wanted = std::find_if(kVideoFormats.begin(), kVideoFormats.end(), [&](std::uint32_t code) {
    return std::find(offered.begin(), offered.end(), code) != offered.end();
  });
  if (wanted == kVideoFormats.end())
    return Error{ErrorCode::unsupported, fmt::format("{}: has formats {}, and none of {} among them", path_, names_of(offered),
                                                     names_of({kVideoFormats.begin(), kVideoFormats.end()}))};
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<std::uint32_t>(width_px);
  format.fmt.pix.height = static_cast<std::uint32_t>(height_px);
  format.fmt.pix.pixelformat = *wanted;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (!ask(fd(), VIDIOC_S_FMT, format)) return error(fmt::format("does not deliver {}", fourcc_name(*wanted)));
  const v4l2_pix_format& given = format.fmt.pix;
  format_ = {given.pixelformat, static_cast<int>(given.width), static_cast<int>(given.height),
             static_cast<int>(given.bytesperline)};
  if (format_.width_px == width_px && format_.height_px == height_px && format_.fourcc == *wanted) return {};
  return Error{ErrorCode::unsupported,
               fmt::format("{}: delivers {} x {} pixels of {}, wanted are {} x {} of {}", path_, format_.width_px,
                           format_.height_px, fourcc_name(format_.fourcc), width_px, height_px, fourcc_name(*wanted))};
}

Result<void> VideoDevice::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (!ask(fd(), VIDIOC_REQBUFS, request) || request.count < 2) return error("gives no buffers");
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = capture_buffer(i);
    if (!ask(fd(), VIDIOC_QUERYBUF, buffer)) return error("gives no buffer");
    void* data = ::mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd(), static_cast<off_t>(buffer.m.offset));
    if (data == MAP_FAILED) return error("a buffer cannot be mapped");
    buffers_.emplace_back(data, buffer.length);
  }
  return {};
}

Result<void> VideoDevice::begin() {
  for (std::uint32_t i = 0; i < buffers_.size(); ++i)
    if (v4l2_buffer buffer = capture_buffer(i); !ask(fd(), VIDIOC_QBUF, buffer)) return error("takes no buffer");
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (!ask(fd(), VIDIOC_STREAMON, type)) return error("does not begin");
  return {};
}

Result<std::optional<VideoFrame>> VideoDevice::take() {
  v4l2_buffer buffer = capture_buffer();
  if (!ask(fd(), VIDIOC_DQBUF, buffer)) {
    if (errno == EAGAIN) return std::optional<VideoFrame>();
    return error("is gone");
  }
  std::optional<VideoFrame> frame;
  const bool whole = (buffer.flags & V4L2_BUF_FLAG_ERROR) == 0 && buffer.index < buffers_.size();
  if (whole) {
    stamps_known_ = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    const Time stamp{buffer.timestamp.tv_sec * 1'000'000'000LL + buffer.timestamp.tv_usec * 1000LL};
    if (auto image = grey_image(format_, buffers_[buffer.index].bytes(buffer.bytesused)))
      frame = VideoFrame{stamps_known_ ? stamp : host_now(), *std::move(image)};
  }
  if (!frame) ++damaged_;
  if (!ask(fd(), VIDIOC_QBUF, buffer)) return error("is gone");
  return frame;
}

}  // namespace fbvins
