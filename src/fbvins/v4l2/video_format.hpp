// SPDX-License-Identifier: Apache-2.0
// Converts the buffers of Linux video devices to grey images. Pure functions, any thread.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

struct VideoFormat {
  std::uint32_t fourcc = 0;
  int width_px = 0, height_px = 0;
  int row_bytes = 0;  ///< from one row to the next; unused for compressed images
};

/// A V4L2 pixel format: four characters, the first in the lowest byte.
constexpr std::uint32_t fourcc(const char (&name)[5]) {
  std::uint32_t code = 0;
  for (int i = 3; i >= 0; --i) code = code << 8 | static_cast<std::uint8_t>(name[i]);
  return code;
}
std::string fourcc_name(std::uint32_t code);

/// Formats that grey_image() takes, in order of preference: uncompressed ones before compressed ones.
inline constexpr std::array kVideoFormats = {fourcc("GREY"), fourcc("NV12"), fourcc("YU12"),
                                             fourcc("YUYV"), fourcc("UYVY"), fourcc("MJPG")};

/// Copies the grey values; colour is dropped. An error where there are too few bytes, or no decodable image.
Result<Image> grey_image(const VideoFormat& format, std::span<const std::uint8_t> bytes);

/// The images of several cameras side by side, from left to right.
std::vector<Image> split_side_by_side(const Image& all, int cameras);

}  // namespace fbvins
