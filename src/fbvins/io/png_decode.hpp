// SPDX-License-Identifier: Apache-2.0
// Private to io: the PNG half of image_decode.hpp, apart because libpng reports errors by longjmp.
#pragma once

#include <string_view>

#include "fbvins/core/result.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

Result<Image> decode_png(std::string_view bytes);
/// One of 16-bit grey, as depth images are.
Result<DepthImage> decode_png16(std::string_view bytes);

/// An error for sizes that only a damaged header has.
Result<void> check_image_size(std::int64_t width, std::int64_t height);

}  // namespace fbvins
