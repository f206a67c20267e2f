// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/png_decode.hpp"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "fbvins/io/image_decode.hpp"

namespace fbvins {
namespace {

/// All that the C callbacks and the code between setjmp and longjmp touch. It lives in a caller's
/// frame, so that a jump passes over no destructor.
struct PngJob {
  std::string_view bytes;
  std::size_t position = 0;
  char message[120] = "not a PNG";
  png_structp png = nullptr;
  png_infop info = nullptr;
  png_uint_32 width = 0, height = 0;
  int channels = 0, bits = 8;
  std::vector<png_bytep> rows;

  ~PngJob() { png_destroy_read_struct(&png, &info, nullptr); }
};

void on_read(png_structp png, png_bytep out, std::size_t length) {
  auto* job = static_cast<PngJob*>(png_get_io_ptr(png));
  if (length > job->bytes.size() - job->position) png_error(png, "cut off");
  std::memcpy(out, job->bytes.data() + job->position, length);
  job->position += length;
}

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  auto* job = static_cast<PngJob*>(png_get_error_ptr(png));
  std::strncpy(job->message, message, sizeof(job->message) - 1);
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

/// Reads the header and asks for 8 bits a channel, 1 or 3 channels; `wide`: for 16 where there are 16, in the machine's byte
/// order.
bool read_header(PngJob& job, bool wide) {
  if (setjmp(png_jmpbuf(job.png))) return false;
  png_set_user_limits(job.png, kLargestImageSide_px, kLargestImageSide_px);
  png_set_read_fn(job.png, &job, on_read);
  png_read_info(job.png, job.info);
  png_set_expand_gray_1_2_4_to_8(job.png);
  png_set_palette_to_rgb(job.png);
  if (!wide) png_set_scale_16(job.png);
  else if constexpr (std::endian::native == std::endian::little) png_set_swap(job.png);
  png_set_strip_alpha(job.png);
  png_set_interlace_handling(job.png);
  png_read_update_info(job.png, job.info);
  job.width = png_get_image_width(job.png, job.info);
  job.height = png_get_image_height(job.png, job.info);
  job.channels = png_get_channels(job.png, job.info);
  job.bits = png_get_bit_depth(job.png, job.info);
  return true;
}

bool read_pixels(PngJob& job) {
  if (setjmp(png_jmpbuf(job.png))) return false;
  png_read_image(job.png, job.rows.data());
  png_read_end(job.png, nullptr);  // the checksums behind the last pixel
  return true;
}

/// ITU-R BT.601 luma with weights in 1/65536.
void to_luma(const std::uint8_t* rgb, int count, std::uint8_t* grey) {
  for (int i = 0; i < count; ++i)
    grey[i] = static_cast<std::uint8_t>((19595u * rgb[3 * i] + 38470u * rgb[3 * i + 1] + 7471u * rgb[3 * i + 2] + 32768u) >> 16u);
}

Error failure(const PngJob& job) { return {ErrorCode::malformed, fmt::format("damaged PNG: {}", job.message)}; }

/// The header, and whether the image is one.
Result<void> begin(PngJob& job, std::string_view bytes, bool wide) {
  job.bytes = bytes;
  job.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &job, on_error, on_warning);
  if (job.png) job.info = png_create_info_struct(job.png);
  if (!job.info || !read_header(job, wide)) return failure(job);
  return check_image_size(job.width, job.height);
}

/// Values of 16 bits, row by row, where the header says so; empty where the image is damaged.
std::vector<std::uint16_t> wide_values(PngJob& job) {
  const std::size_t row = static_cast<std::size_t>(job.width) * static_cast<std::size_t>(job.channels);
  std::vector<std::uint16_t> values(row * job.height);
  for (std::size_t y = 0; y < job.height; ++y) job.rows.push_back(reinterpret_cast<png_bytep>(values.data() + y * row));
  if (!read_pixels(job)) values.clear();
  return values;
}

/// The upper eight of the bits used; brighter than these can say is white.
Result<Image> narrowed(PngJob& job, int used_bits) {
  const std::vector<std::uint16_t> values = wide_values(job);
  if (values.empty()) return failure(job);
  std::vector<std::uint8_t> narrow(values.size());
  std::ranges::transform(values, narrow.begin(),
                         [&](int v) { return static_cast<std::uint8_t>(std::min(v >> (used_bits - 8), 255)); });
  Image image(static_cast<int>(job.width), static_cast<int>(job.height));
  const std::size_t row = static_cast<std::size_t>(job.width) * static_cast<std::size_t>(job.channels);
  for (int y = 0; y < image.height(); ++y) {
    const std::uint8_t* from = narrow.data() + row * static_cast<std::size_t>(y);
    if (job.channels == 3) to_luma(from, image.width(), image.row(y));
    else std::copy_n(from, row, image.row(y));
  }
  return image;
}

}  // namespace

std::optional<std::uint16_t> largest_value_of_png16(std::string_view bytes) {
  PngJob job;
  if (!begin(job, bytes, true) || job.bits != 16) return std::nullopt;
  const std::vector<std::uint16_t> values = wide_values(job);
  return values.empty() ? std::nullopt : std::optional(*std::ranges::max_element(values));
}

Result<Image> decode_png(std::string_view bytes, int used_bits) {
  PngJob job;
  if (Result<void> begun = begin(job, bytes, used_bits < 16); !begun) return begun.error();
  if (job.channels != 1 && job.channels != 3)
    return Error{ErrorCode::unsupported, fmt::format("a PNG of {} channels", job.channels)};
  if (job.bits == 16) return narrowed(job, used_bits);
  const int width = static_cast<int>(job.width), height = static_cast<int>(job.height);
  Image image(width, height);
  std::vector<std::uint8_t> colour;
  if (job.channels == 3) colour.resize(3 * static_cast<std::size_t>(width) * height);
  job.rows.resize(job.height);
  for (int y = 0; y < height; ++y)
    job.rows[y] = colour.empty() ? image.row(y) : colour.data() + 3 * static_cast<std::size_t>(width) * y;
  if (!read_pixels(job)) return failure(job);
  if (!colour.empty())
    for (int y = 0; y < height; ++y) to_luma(job.rows[y], width, image.row(y));
  return image;
}

Result<DepthImage> decode_png16(std::string_view bytes) {
  PngJob job;
  if (Result<void> begun = begin(job, bytes, true); !begun) return begun.error();
  if (job.channels != 1 || job.bits != 16)
    return Error{ErrorCode::unsupported,
                 fmt::format("{} channels of {} bits where a depth image has one of 16", job.channels, job.bits)};
  DepthImage image{static_cast<int>(job.width), static_cast<int>(job.height), {}};
  image.mm.resize(static_cast<std::size_t>(image.width) * job.height);
  for (std::size_t y = 0; y < job.height; ++y)
    job.rows.push_back(reinterpret_cast<png_bytep>(image.mm.data() + y * static_cast<std::size_t>(image.width)));
  if (!read_pixels(job)) return failure(job);
  return image;
}

}  // namespace fbvins
