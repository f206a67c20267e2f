// SPDX-License-Identifier: Apache-2.0
// An 8-bit grey image, rows top to bottom. Immutable once shared.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/types/by_camera.hpp"

namespace fbvins {

/// A view of pixels that it does not own.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;  ///< bytes from one row to the next

  const std::uint8_t* row(int y) const { return data + y * stride; }
  bool empty() const { return data == nullptr || width == 0 || height == 0; }
};

class Image {
 public:
  Image() = default;
  Image(int width, int height, std::uint8_t fill = 0)
      : width_(width), height_(height), pixels_(static_cast<std::size_t>(width) * height, fill) {}
  /// Pixels in foreign memory, row after row: read in place, kept alive by `keeper` until the last copy of this image is
  /// gone, never written. A write to the image first copies them to pixels of its own.
  Image(int width, int height, std::shared_ptr<const std::uint8_t> keeper)
      : width_(width), height_(height), foreign_(std::move(keeper)) {}

  int width() const { return width_; }
  int height() const { return height_; }
  bool empty() const { return pixels_.empty() && !foreign_; }
  bool foreign() const { return foreign_ != nullptr; }
  std::uint8_t* row(int y) {
    if (foreign_) copy_foreign();
    return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_;
  }
  const std::uint8_t* row(int y) const { return data() + static_cast<std::ptrdiff_t>(y) * width_; }
  std::uint8_t& at(int x, int y) { return row(y)[x]; }
  std::uint8_t at(int x, int y) const { return row(y)[x]; }
  ImageView view() const { return {data(), width_, height_, width_}; }

 private:
  const std::uint8_t* data() const { return foreign_ ? foreign_.get() : pixels_.data(); }
  void copy_foreign() {
    pixels_.assign(foreign_.get(), foreign_.get() + static_cast<std::size_t>(width_) * height_);
    foreign_.reset();
  }

  int width_ = 0;
  int height_ = 0;
  std::vector<std::uint8_t> pixels_;
  std::shared_ptr<const std::uint8_t> foreign_;
};

/// Distances along z of the left camera, in millimetres, pixel by pixel of its image: row after row; 0 where none was measured.
struct DepthImage {
  int width = 0, height = 0;
  std::vector<std::uint16_t> mm;

  const std::uint16_t* row(int y) const { return mm.data() + static_cast<std::ptrdiff_t>(y) * width; }
};

/// Of cameras without a common trigger: how long after the frame's t each of them took its image; before it where negative.
/// Cameras that are missing at the end took theirs at t.
class ExposureOffsets {
 public:
  ExposureOffsets() = default;
  explicit ExposureOffsets(std::vector<Duration> of_cameras) : of_cameras_(std::move(of_cameras)) {}
  Duration of(int camera) const { return of_camera(of_cameras_, camera); }
  void set(int camera, Duration offset) { of_camera(of_cameras_, camera) = offset; }
  bool all_zero() const { return longest().ns == 0; }
  /// Of all cameras, without its sign.
  Duration longest() const {
    Duration out;
    for (const Duration d : of_cameras_) out.ns = std::max(out.ns, std::abs(d.ns));
    return out;
  }
  /// Whether two cameras took their images so far apart that it shows: 0.1 ms.
  bool are_apart(int first, int second) const { return std::abs((of(first) - of(second)).ns) > 100'000; }
  /// Camera by camera.
  ExposureOffsets& operator+=(const ExposureOffsets& more) {
    for (std::size_t i = 0; i < more.of_cameras_.size(); ++i)
      set(static_cast<int>(i), of(static_cast<int>(i)) + more.of_cameras_[i]);
    return *this;
  }
  ExposureOffsets& operator-=(const ExposureOffsets& less) {
    for (std::size_t i = 0; i < less.of_cameras_.size(); ++i)
      set(static_cast<int>(i), of(static_cast<int>(i)) - less.of_cameras_[i]);
    return *this;
  }
  bool operator==(const ExposureOffsets&) const = default;

 private:
  std::vector<Duration> of_cameras_;
};

/// Images of the rig's cameras, by number, taken at the same instant unless `offsets` says otherwise. A camera that delivered
/// nothing has a null pointer, or is missing at the end.
struct StereoFrame {
  Time t;
  std::vector<std::shared_ptr<const Image>> images = {};
  std::shared_ptr<const DepthImage> depth = {};  ///< of a rig with a depth sensor
  ExposureOffsets offsets = {};
  bool after_clock_step = false;  ///< the first one since the clock stepped back: nobody knows how much time has passed

  const std::shared_ptr<const Image>& image(int camera) const { return of_camera(images, camera); }
  const std::shared_ptr<const Image>& left() const { return image(0); }
  const std::shared_ptr<const Image>& right() const { return image(1); }
  void set_image(int camera, std::shared_ptr<const Image> image) { of_camera(images, camera) = std::move(image); }
  void swap_left_right() {
    images.resize(std::max<std::size_t>(2, images.size()));
    std::swap(images[0], images[1]);
  }
  bool without_images() const {
    return std::ranges::all_of(images, [](const auto& image) { return image == nullptr; });
  }
};

}  // namespace fbvins
