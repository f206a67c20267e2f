// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/grey_image.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

using Row = const std::uint8_t*;

void take_mono8(Row in, std::uint8_t* out, int width) { std::memcpy(out, in, static_cast<std::size_t>(width)); }

/// The high byte of each pair; `high` is its index.
template <int high>
void take_mono16(Row in, std::uint8_t* out, int width) {
  for (int x = 0; x < width; ++x) out[x] = in[2 * x + high];
}

template <int red, int blue, int channels>
void take_colour(Row in, std::uint8_t* out, int width) {
  for (int x = 0; x < width; ++x, in += channels)
    out[x] = static_cast<std::uint8_t>((299 * in[red] + 587 * in[1] + 114 * in[blue] + 500) / 1000);
}

/// Brightness and colour take turns.
template <int brightness>
void take_yuv422(Row in, std::uint8_t* out, int width) {
  for (int x = 0; x < width; ++x) out[x] = in[2 * x + brightness];
}

struct Format {
  std::string_view name;
  int bytes_per_pixel;
  void (*take)(Row in, std::uint8_t* out, int width);
};

constexpr Format kFormats[] = {
    {"mono8", 1, take_mono8},           {"8UC1", 1, take_mono8},
    {"mono16", 2, take_mono16<1>},      {"16UC1", 2, take_mono16<1>},
    {"rgb8", 3, take_colour<0, 2, 3>},  {"bgr8", 3, take_colour<2, 0, 3>},
    {"8UC3", 3, take_colour<2, 0, 3>},  {"rgba8", 4, take_colour<0, 2, 4>},
    {"bgra8", 4, take_colour<2, 0, 4>}, {"yuv422", 2, take_yuv422<1>},
    {"yuv422_yuy2", 2, take_yuv422<0>}, {"bayer_rggb8", 1, take_mono8},
    {"bayer_bggr8", 1, take_mono8},     {"bayer_gbrg8", 1, take_mono8},
    {"bayer_grbg8", 1, take_mono8},
};

/// (1 2 1)/4 both ways, mirrored at the edges so that the mosaic's pattern continues.
Image smooth_mosaic(const Image& mosaic) {
  const int width = mosaic.width(), height = mosaic.height();
  Image out(width, height);
  const auto inside = [](int i, int n) { return i < 0 ? std::min(-i, n - 1) : i >= n ? std::max(2 * n - 2 - i, 0) : i; };
  for (int y = 0; y < height; ++y) {
    const Row above = mosaic.row(inside(y - 1, height)), here = mosaic.row(y), below = mosaic.row(inside(y + 1, height));
    const auto column = [&](int x) { return above[x] + 2 * here[x] + below[x]; };
    std::uint8_t* to = out.row(y);
    for (int x = 0; x < width; ++x)
      to[x] = static_cast<std::uint8_t>((column(inside(x - 1, width)) + 2 * column(x) + column(inside(x + 1, width)) + 8) / 16);
  }
  return out;
}

}  // namespace

Result<Image> grey_image(const RawImage& raw) {
  const auto* format =
      std::find_if(std::begin(kFormats), std::end(kFormats), [&](const Format& f) { return f.name == raw.encoding; });
  if (format == std::end(kFormats))
    return Error{ErrorCode::unsupported, fmt::format("images encoded as '{}' cannot be read", quoted(raw.encoding))};
  if (raw.width < 1 || raw.height < 1 || raw.width > kLargestImageSide_px || raw.height > kLargestImageSide_px)
    return Error{ErrorCode::unsupported, fmt::format("an image of {} x {} pixels", raw.width, raw.height)};
  const std::uint64_t row_bytes = std::uint64_t{raw.width} * static_cast<std::uint64_t>(format->bytes_per_pixel);
  const std::uint64_t needed = std::uint64_t{raw.step} * (raw.height - 1) + row_bytes;
  if (raw.step < row_bytes || needed > raw.pixels.size())
    return Error{ErrorCode::malformed, "this image has fewer pixels than its header says"};
  Image image(static_cast<int>(raw.width), static_cast<int>(raw.height));
  const bool swapped = raw.big_endian && format->take == take_mono16<1>;
  const auto take = swapped ? take_mono16<0> : format->take;
  for (int y = 0; y < image.height(); ++y)
    take(reinterpret_cast<Row>(raw.pixels.data()) + std::uint64_t{raw.step} * static_cast<std::uint64_t>(y), image.row(y),
         image.width());
  return raw.encoding.starts_with("bayer") ? smooth_mosaic(image) : image;
}

}  // namespace fbvins
