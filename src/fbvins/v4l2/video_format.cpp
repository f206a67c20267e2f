// SPDX-License-Identifier: Apache-2.0
#include "fbvins/v4l2/video_format.hpp"

#include <fmt/format.h>

#include <cstring>

#include "fbvins/io/image_decode.hpp"

namespace fbvins {
namespace {

/// Position of the grey values in a row: offset of the first, and step from one to the next, in bytes.
struct Luma {
  int first = 0, step = 1;
};

Luma luma(std::uint32_t code) {
  if (code == fourcc("YUYV")) return {0, 2};
  if (code == fourcc("UYVY")) return {1, 2};
  return {0, 1};  // grey alone, or a plane of its own before the colours'
}

}  // namespace

std::string fourcc_name(std::uint32_t code) {
  std::string name;
  for (int i = 0; i < 4; ++i) name += static_cast<char>(code >> (8 * i) & 0xff);
  return name;
}

Result<Image> grey_image(const VideoFormat& format, std::span<const std::uint8_t> bytes) {
  if (format.fourcc == fourcc("MJPG")) {
    auto image = decode_image({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    if (!image || (image->width() == format.width_px && image->height() == format.height_px)) return image;
    return Error{ErrorCode::malformed, fmt::format("an image of {} x {} pixels, it should have {} x {}", image->width(),
                                                   image->height(), format.width_px, format.height_px)};
  }
  const auto [first, step] = luma(format.fourcc);
  const auto row_bytes = static_cast<std::size_t>(format.row_bytes);
  const auto width = static_cast<std::size_t>(format.width_px), height = static_cast<std::size_t>(format.height_px);
  if (row_bytes < width * static_cast<std::size_t>(step) || bytes.size() < row_bytes * height)
    return Error{ErrorCode::malformed, fmt::format("{} bytes, too few for {} x {} pixels of {}", bytes.size(), width, height,
                                                   fourcc_name(format.fourcc))};
  Image image(format.width_px, format.height_px);
  for (int y = 0; y < format.height_px; ++y) {
    const std::uint8_t* from = bytes.data() + static_cast<std::size_t>(y) * row_bytes + first;
    std::uint8_t* to = image.row(y);
    if (step == 1) {
      std::memcpy(to, from, width);
    } else {
      for (int x = 0; x < format.width_px; ++x) to[x] = from[x * step];
    }
  }
  return image;
}

std::vector<Image> split_side_by_side(const Image& all, int cameras) {
  const int width = all.width() / cameras;
  std::vector<Image> parts;
  for (int i = 0; i < cameras; ++i) {
    Image& part = parts.emplace_back(width, all.height());
    for (int y = 0; y < all.height(); ++y) std::memcpy(part.row(y), all.row(y) + i * width, static_cast<std::size_t>(width));
  }
  return parts;
}

}  // namespace fbvins
