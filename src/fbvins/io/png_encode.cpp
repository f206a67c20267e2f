// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/png_encode.hpp"

#include <png.h>

#include <cstddef>

namespace fbvins {
namespace {

std::string encode(const std::vector<const std::uint8_t*>& rows, int width, int depth) {
  std::string bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &bytes,
      [](png_structp p, png_bytep data, png_size_t size) {
        static_cast<std::string*>(png_get_io_ptr(p))->append(reinterpret_cast<const char*>(data), size);
      },
      [](png_structp) {});
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(rows.size()), depth, PNG_COLOR_TYPE_GRAY,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, 1);
  png_set_filter(png, 0, PNG_FILTER_SUB);
  // Huffman coding alone: noisy images have no repetitions to search for, and it is far faster.
  png_set_compression_strategy(png, 2);
  png_write_info(png, info);
  for (const std::uint8_t* row : rows) png_write_row(png, row);
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

}  // namespace

std::string encode_png(const Image& image) {
  std::vector<const std::uint8_t*> rows;
  for (int y = 0; y < image.height(); ++y) rows.push_back(image.row(y));
  return encode(rows, image.width(), 8);
}

std::string encode_png16(const std::vector<std::uint16_t>& values, int width, int height) {
  std::vector<std::uint8_t> bytes;  // PNG has the high byte first
  for (std::uint16_t v : values)
    bytes.insert(bytes.end(), {static_cast<std::uint8_t>(v >> 8), static_cast<std::uint8_t>(v & 255)});
  std::vector<const std::uint8_t*> rows;
  for (int y = 0; y < height; ++y) rows.push_back(bytes.data() + static_cast<std::ptrdiff_t>(y) * width * 2);
  return encode(rows, width, 16);
}

}  // namespace fbvins
