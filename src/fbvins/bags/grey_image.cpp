// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/grey_image.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

using Row = const std::uint8_t*;

void take_mono(Row in, std::uint8_t* out, int width) { std::memcpy(out, in, static_cast<std::size_t>(width)); }

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
  int channels;    ///< values a pixel
  int value_bits;  ///< 16: narrowed to 8 before `take`
  void (*take)(Row in, std::uint8_t* out, int width);
  bool planar = false;  ///< all of the brightness, then the colour
};

constexpr Format kFormats[] = {
    {"mono8", 1, 8, take_mono},
    {"8UC1", 1, 8, take_mono},
    {"mono16", 1, 16, take_mono},
    {"16UC1", 1, 16, take_mono},
    {"rgb8", 3, 8, take_colour<0, 2, 3>},
    {"bgr8", 3, 8, take_colour<2, 0, 3>},
    {"8UC3", 3, 8, take_colour<2, 0, 3>},
    {"rgba8", 4, 8, take_colour<0, 2, 4>},
    {"bgra8", 4, 8, take_colour<2, 0, 4>},
    {"8UC4", 4, 8, take_colour<2, 0, 4>},
    {"rgb16", 3, 16, take_colour<0, 2, 3>},
    {"bgr16", 3, 16, take_colour<2, 0, 3>},
    {"16UC3", 3, 16, take_colour<2, 0, 3>},
    {"rgba16", 4, 16, take_colour<0, 2, 4>},
    {"bgra16", 4, 16, take_colour<2, 0, 4>},
    {"16UC4", 4, 16, take_colour<2, 0, 4>},
    {"yuv422", 2, 8, take_yuv422<1>},
    {"uyvy", 2, 8, take_yuv422<1>},
    {"yuv422_yuy2", 2, 8, take_yuv422<0>},
    {"yuyv", 2, 8, take_yuv422<0>},
    {"nv12", 1, 8, take_mono, true},
    {"nv21", 1, 8, take_mono, true},
    {"nv24", 1, 8, take_mono, true},
    {"bayer_rggb8", 1, 8, take_mono},
    {"bayer_bggr8", 1, 8, take_mono},
    {"bayer_gbrg8", 1, 8, take_mono},
    {"bayer_grbg8", 1, 8, take_mono},
    {"bayer_rggb16", 1, 16, take_mono},
    {"bayer_bggr16", 1, 16, take_mono},
    {"bayer_gbrg16", 1, 16, take_mono},
    {"bayer_grbg16", 1, 16, take_mono},
};

/// An image whose rows are known to lie in its bytes.
struct CheckedImage {
  const Format* format;
  std::uint64_t step;
  std::size_t row_values;

  Row row(const RawImage& raw, int y) const {
    return reinterpret_cast<Row>(raw.pixels.data()) + step * static_cast<std::uint64_t>(y);
  }
};

Result<CheckedImage> check(const RawImage& raw) {
  const auto* format =
      std::find_if(std::begin(kFormats), std::end(kFormats), [&](const Format& f) { return f.name == raw.encoding; });
  if (format == std::end(kFormats))
    return Error{ErrorCode::unsupported, fmt::format("images encoded as '{}' cannot be read", fbvins::quoted(raw.encoding))};
  if (raw.width < 1 || raw.height < 1 || raw.width > kLargestImageSide_px || raw.height > kLargestImageSide_px)
    return Error{ErrorCode::unsupported, fmt::format("an image of {} x {} pixels", raw.width, raw.height)};
  const std::uint64_t row_values = std::uint64_t{raw.width} * static_cast<std::uint64_t>(format->channels);
  const std::uint64_t row_bytes = row_values * static_cast<std::uint64_t>(format->value_bits / 8);
  // Some drivers give the bytes a pixel of all planes together as the step of the first.
  const bool of_all_planes = format->planar && std::uint64_t{raw.step} * raw.height > raw.pixels.size();
  const std::uint64_t step = of_all_planes ? row_bytes : raw.step;
  if (step < row_bytes || step * (raw.height - 1) + row_bytes > raw.pixels.size())
    return Error{ErrorCode::malformed, "this image has fewer pixels than its header says"};
  return CheckedImage{format, step, static_cast<std::size_t>(row_values)};
}

std::uint16_t value_at(Row in, std::size_t i, bool big_endian) {
  const Row at = in + 2 * i;
  return static_cast<std::uint16_t>(big_endian ? at[0] << 8 | at[1] : at[1] << 8 | at[0]);
}

/// The upper eight of the bits used; brighter than these can say is white.
void narrow(Row in, bool big_endian, int used_bits, std::vector<std::uint8_t>& out) {
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = static_cast<std::uint8_t>(std::min(value_at(in, i, big_endian) >> (used_bits - 8), 255));
}

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
  const Result<CheckedImage> checked = check(raw);
  if (!checked) return checked.error();
  const Format& format = *checked->format;
  Image image(static_cast<int>(raw.width), static_cast<int>(raw.height));
  std::vector<std::uint8_t> narrowed(format.value_bits == 16 ? checked->row_values : 0);
  for (int y = 0; y < image.height(); ++y) {
    const Row row = checked->row(raw, y);
    if (!narrowed.empty()) narrow(row, raw.big_endian, raw.used_bits, narrowed);
    format.take(narrowed.empty() ? row : narrowed.data(), image.row(y), image.width());
  }
  return raw.encoding.starts_with("bayer") ? smooth_mosaic(image) : image;
}

std::optional<std::uint16_t> largest_value(const RawImage& raw) {
  const Result<CheckedImage> checked = check(raw);
  if (!checked || checked->format->value_bits != 16) return std::nullopt;
  std::uint16_t largest = 0;
  for (std::uint32_t y = 0; y < raw.height; ++y)
    for (std::size_t i = 0; i < checked->row_values; ++i)
      largest = std::max(largest, value_at(checked->row(raw, static_cast<int>(y)), i, raw.big_endian));
  return largest;
}

}  // namespace fbvins
