// SPDX-License-Identifier: Apache-2.0
// Private to io. Fast PNG, with one filter and the lowest compression: 8-bit or 16-bit grey. Pure functions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fbvins/types/image.hpp"

namespace fbvins {

std::string encode_png(const Image& image);
std::string encode_png16(const std::vector<std::uint16_t>& values, int width, int height);

}  // namespace fbvins
