// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/image_decode.hpp"

#include <fmt/format.h>
#include <turbojpeg.h>

#include <utility>

#include "fbvins/io/png_decode.hpp"

namespace fbvins {
namespace {

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";

Result<Image> decode_jpeg(std::string_view bytes) {
  struct Handle {
    tjhandle tj = tjInitDecompress();
    ~Handle() {
      if (tj) tjDestroy(tj);
    }
  } handle;
  const auto failure = [&] { return Error{ErrorCode::malformed, fmt::format("damaged JPEG: {}", tjGetErrorStr2(handle.tj))}; };
  if (!handle.tj) return failure();
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (tjDecompressHeader3(handle.tj, data, bytes.size(), &width, &height, &subsampling, &colours) != 0) return failure();
  if (Result<void> size = check_image_size(width, height); !size) return size.error();
  Image image(width, height);
  // A warning means that the rest of the image is invented.
  constexpr int kFlags = TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS;
  if (tjDecompress2(handle.tj, data, bytes.size(), image.row(0), width, width, height, TJPF_GRAY, kFlags) != 0) return failure();
  return image;
}

/// By the first bytes; null where they are of none known.
const char* other_format(std::string_view bytes) {
  constexpr std::pair<std::string_view, const char*> kFormats[] = {{"BM", "BMP"},
                                                                   {"P2", "PGM"},
                                                                   {"P5", "PGM"},
                                                                   {"P3", "PPM"},
                                                                   {"P6", "PPM"},
                                                                   {"GIF8", "GIF"},
                                                                   {"RIFF", "WebP"},
                                                                   {std::string_view("II*\0", 4), "TIFF"},
                                                                   {std::string_view("MM\0*", 4), "TIFF"}};
  for (const auto& [signature, name] : kFormats)
    if (bytes.starts_with(signature)) return name;
  return nullptr;
}

}  // namespace

Result<void> check_image_size(std::int64_t width, std::int64_t height) {
  if (width >= 1 && height >= 1 && width <= kLargestImageSide_px && height <= kLargestImageSide_px &&
      width * height <= kLargestImage_px)
    return {};
  return Error{ErrorCode::unsupported, fmt::format("an image of {} x {} pixels", width, height)};
}

Result<Image> decode_image(std::string_view bytes, int used_bits) {
  if (bytes.empty()) return Error{ErrorCode::malformed, "the file is empty"};
  if (bytes.starts_with(kPngSignature)) return decode_png(bytes, used_bits);
  if (bytes.starts_with("\xFF\xD8\xFF")) return decode_jpeg(bytes);
  const char* found = other_format(bytes);
  return Error{ErrorCode::malformed,
               found == nullptr ? "neither PNG nor JPEG" : fmt::format("{}, neither PNG nor JPEG: write images as PNG", found)};
}

std::optional<std::uint16_t> largest_value_of_png(std::string_view bytes) {
  return bytes.starts_with(kPngSignature) ? largest_value_of_png16(bytes) : std::nullopt;
}

int bits_used_for(std::uint16_t largest) {
  for (const int bits : {8, 10, 12})
    if (largest > 0 && largest < 1 << bits) return bits;
  return 16;
}

std::string used_bits_sentence(const std::string& recording, int bits) {
  return fmt::format("{}: images of 16 bits have values of {} bits only, and are scaled by {}", recording, bits,
                     1 << (16 - bits));
}

Result<DepthImage> decode_depth(std::string_view bytes) {
  if (!bytes.starts_with(kPngSignature)) return Error{ErrorCode::malformed, "no PNG, which depth images are"};
  return decode_png16(bytes);
}

std::optional<std::string> wrong_size(std::int64_t width, std::int64_t height, const Camera& camera) {
  if (width == camera.width() && height == camera.height()) return std::nullopt;
  return fmt::format("{} x {} pixels where the calibration says {} x {}", width, height, camera.width(), camera.height());
}

}  // namespace fbvins
