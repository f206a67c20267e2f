// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/depth_image.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

template <class Number>
Number number_at(const char* bytes, bool big_endian) {
  char ordered[sizeof(Number)];
  std::memcpy(ordered, bytes, sizeof(Number));
  if (big_endian) std::reverse(std::begin(ordered), std::end(ordered));
  return std::bit_cast<Number>(ordered);
}

std::uint16_t mm_of(float depth_m) {
  constexpr float kMost_mm = std::numeric_limits<std::uint16_t>::max();
  const float mm = 1000 * depth_m;
  return mm > 0 && mm <= kMost_mm ? static_cast<std::uint16_t>(std::lround(mm)) : std::uint16_t{0};
}

}  // namespace

Result<DepthImage> depth_image(const RawImage& raw) {
  const bool floats = raw.encoding == "32FC1";
  if (!floats && raw.encoding != "16UC1" && raw.encoding != "mono16")
    return Error{ErrorCode::unsupported,
                 fmt::format("depth images encoded as '{}' cannot be read, only 16UC1 and 32FC1", fbvins::quoted(raw.encoding))};
  const std::size_t size = floats ? sizeof(float) : sizeof(std::uint16_t);
  if (raw.width < 1 || raw.height < 1 || raw.width > kLargestImageSide_px || raw.height > kLargestImageSide_px ||
      raw.step < raw.width * size || raw.pixels.size() < std::size_t{raw.step} * raw.height)
    return Error{ErrorCode::malformed, "this image has fewer pixels than its header says"};
  DepthImage out{static_cast<int>(raw.width), static_cast<int>(raw.height), {}};
  out.mm.reserve(std::size_t{raw.width} * raw.height);
  for (std::size_t y = 0; y < raw.height; ++y)
    for (std::size_t x = 0; x < raw.width; ++x) {
      const char* at = raw.pixels.data() + y * raw.step + x * size;
      out.mm.push_back(floats ? mm_of(number_at<float>(at, raw.big_endian)) : number_at<std::uint16_t>(at, raw.big_endian));
    }
  return out;
}

}  // namespace fbvins
