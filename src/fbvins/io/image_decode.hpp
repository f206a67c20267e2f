// SPDX-License-Identifier: Apache-2.0
// PNG and JPEG to 8-bit grey, recognised by content. Pure functions, any thread.
//
//   Result<Image> image = decode_image(bytes);
//
// Colour becomes luma (ITU-R BT.601 weights), 16 bit is scaled to 8, transparency is dropped. Cameras of 10 and 12 bits write
// these in 16, where the upper eight would be almost black: how many they use is found from some of a recording's images. A file
// that is damaged or cut off anywhere is an error: half an image is no image.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

inline constexpr int kLargestImageSide_px = 16384;
inline constexpr std::int64_t kLargestImage_px = std::int64_t{64} << 20;

/// The message says what is wrong with the bytes, without a file name. `used_bits` of a PNG's 16: the upper eight of these are
/// kept, and what is brighter is white.
Result<Image> decode_image(std::string_view bytes, int used_bits = 16);

/// The largest value of a PNG of 16 bits; none of other images, and of damaged ones.
std::optional<std::uint16_t> largest_value_of_png(std::string_view bytes);

/// The bits that a camera uses whose largest value this is: 8, 10, 12 or, for anything larger, 16 (also where all is black).
int bits_used_for(std::uint16_t largest);

/// What is said of images of fewer bits than 16.
std::string used_bits_sentence(const std::string& recording, int bits);

/// A depth image: a 16-bit grey PNG, in millimetres.
Result<DepthImage> decode_depth(std::string_view bytes);

/// One sentence about an image that is not of its camera's size; none where it is.
std::optional<std::string> wrong_size(std::int64_t width, std::int64_t height, const Camera& camera);

}  // namespace fbvins
