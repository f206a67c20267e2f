// SPDX-License-Identifier: Apache-2.0
// Private to bags: pixels as ROS names them to 8-bit grey. Pure functions, any thread.
//
//   Result<Image> image = grey_image({752, 480, 752, "mono8", false, bytes});
//
// Colour becomes luma (ITU-R BT.601 weights), of 16 bit the upper eight of those used are kept, of YUV the brightness; a Bayer
// mosaic is smoothed by (1 2 1)/4 both ways, which weighs red, green and blue the same (1, 2, 1) at every pixel.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "fbvins/core/result.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

struct RawImage {
  std::uint32_t width = 0, height = 0, step = 0;  ///< px, px, bytes from row to row
  std::string_view encoding;
  bool big_endian = false;
  std::string_view pixels;
  int used_bits = 16;  ///< of 16-bit values: cameras of 10 and 12 bits send these in 16
};

/// An error for an unknown encoding, or for fewer pixels than the size needs.
Result<Image> grey_image(const RawImage& raw);

/// The largest value of an image of 16-bit values; none for other encodings and where grey_image() gives an error.
std::optional<std::uint16_t> largest_value(const RawImage& raw);

}  // namespace fbvins
