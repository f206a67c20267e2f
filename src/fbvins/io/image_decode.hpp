// SPDX-License-Identifier: Apache-2.0
// PNG and JPEG to 8-bit grey, recognised by content. Pure functions, any thread.
//
//   Result<Image> image = decode_image(bytes);
//
// Colour becomes luma (ITU-R BT.601 weights), 16 bit is scaled to 8, transparency is dropped.
// A file that is damaged or cut off anywhere is an error: half an image is no image.
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

/// The message says what is wrong with the bytes, without a file name.
Result<Image> decode_image(std::string_view bytes);

/// A depth image: a 16-bit grey PNG, in millimetres.
Result<DepthImage> decode_depth(std::string_view bytes);

/// One sentence about an image that is not of its camera's size; none where it is.
std::optional<std::string> wrong_size(std::int64_t width, std::int64_t height, const Camera& camera);

}  // namespace fbvins
