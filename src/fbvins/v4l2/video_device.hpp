// SPDX-License-Identifier: Apache-2.0
// A Linux video device (V4L2) as a stream of grey images. One thread.
//
//   auto device = VideoDevice::open("/dev/video0", 752, 480);
//   poll device->fd() for POLLIN; then
//   Result<std::optional<VideoFrame>> frame = device->take();    // an error: the device is gone
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/v4l2/video_format.hpp"

namespace fbvins {

struct VideoFrame {
  Time t;  ///< on CLOCK_MONOTONIC, as the driver stamps it
  Image image;
};

class VideoDevice {
 public:
  /// Starts streaming images of this size in the first of kVideoFormats that the device has. An error says what it offers.
  static Result<VideoDevice> open(const std::string& path, int width_px, int height_px);

  int fd() const { return descriptor_.number(); }
  const std::string& path() const { return path_; }
  const VideoFormat& format() const { return format_; }
  /// False: the driver's stamps are not on CLOCK_MONOTONIC, and images are stamped on arrival.
  bool stamps_are_the_drivers() const { return stamps_known_; }
  /// The next waiting image, or none. Damaged images are left out and counted.
  Result<std::optional<VideoFrame>> take();
  int damaged() const { return damaged_; }

 private:
  /// A driver's buffer mapped into our memory.
  class Buffer {
   public:
    Buffer(void* data, std::size_t size) : data_(data), size_(size) {}
    Buffer(Buffer&& other) noexcept;
    Buffer& operator=(Buffer&& other) noexcept;
    ~Buffer();
    std::span<const std::uint8_t> bytes(std::size_t used) const;

   private:
    void* data_ = nullptr;
    std::size_t size_ = 0;
  };

  VideoDevice(FileDescriptor descriptor, std::string path) : descriptor_(std::move(descriptor)), path_(std::move(path)) {}
  Result<void> choose_format(int width_px, int height_px);
  Result<void> map_buffers();
  Result<void> begin();
  Error error(const std::string& what) const;

  // In this order buffers are unmapped before the device is closed.
  FileDescriptor descriptor_;
  std::string path_;
  VideoFormat format_;
  std::vector<Buffer> buffers_;
  bool stamps_known_ = true;
  int damaged_ = 0;
};

}  // namespace fbvins
