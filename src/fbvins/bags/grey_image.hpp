// SPDX-License-Identifier: Apache-2.0
// Private to bags: pixels as ROS names them to 8-bit grey. Pure function, any thread.
//
//   Result<Image> image = grey_image({752, 480, 752, "mono8", false, bytes});
//
// Colour becomes luma (ITU-R BT.601 weights), 16 bit keeps its high byte, a Bayer mosaic is smoothed by (1 2 1)/4 both ways,
// which weighs red, green and blue the same (1, 2, 1) at every pixel.
#pragma once

#include <cstdint>
#include <string_view>

#include "fbvins/core/result.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

struct RawImage {
  std::uint32_t width = 0, height = 0, step = 0;  ///< px, px, bytes from row to row
  std::string_view encoding;
  bool big_endian = false;
  std::string_view pixels;
};

/// An error for an unknown encoding, or for fewer pixels than the size needs.
Result<Image> grey_image(const RawImage& raw);

}  // namespace fbvins
