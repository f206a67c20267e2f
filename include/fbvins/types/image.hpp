// SPDX-License-Identifier: Apache-2.0
// An 8-bit grey image, rows top to bottom. Immutable once shared.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "fbvins/core/time.hpp"

namespace fbvins {

/// A view of somebody's pixels.
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

  int width() const { return width_; }
  int height() const { return height_; }
  bool empty() const { return pixels_.empty(); }
  std::uint8_t* row(int y) { return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_; }
  const std::uint8_t* row(int y) const { return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_; }
  std::uint8_t& at(int x, int y) { return row(y)[x]; }
  std::uint8_t at(int x, int y) const { return row(y)[x]; }
  ImageView view() const { return {pixels_.data(), width_, height_, width_}; }

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<std::uint8_t> pixels_;
};

/// Two images taken at the same instant. A camera that delivered nothing has a null pointer.
struct StereoFrame {
  Time t;
  std::shared_ptr<const Image> left;
  std::shared_ptr<const Image> right;
};

}  // namespace fbvins
