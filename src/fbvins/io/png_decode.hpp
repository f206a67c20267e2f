// SPDX-License-Identifier: Apache-2.0
// Private to io: the PNG half of image_decode.hpp, apart because libpng reports errors by longjmp.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "fbvins/core/result.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// Of 16 bits of which only `used_bits` are used the upper eight of these.
Result<Image> decode_png(std::string_view bytes, int used_bits);
/// None of an image of 8 bits, and where the bytes are no whole PNG.
std::optional<std::uint16_t> largest_value_of_png16(std::string_view bytes);
/// One of 16-bit grey, as depth images are.
Result<DepthImage> decode_png16(std::string_view bytes);

/// An error for sizes that only a damaged header has.
Result<void> check_image_size(std::int64_t width, std::int64_t height);

}  // namespace fbvins
