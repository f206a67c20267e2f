// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/grey_jpeg.hpp"

#include <turbojpeg.h>

namespace fbvins {
namespace {

constexpr int kMostWidth_px = 800;
constexpr int kQuality = 55;

/// Means of two by two pixels.
Image halved(const Image& image) {
  Image half(image.width() / 2, image.height() / 2);
  for (int y = 0; y < half.height(); ++y) {
    const std::uint8_t *upper = image.row(2 * y), *lower = image.row(2 * y + 1);
    std::uint8_t* out = half.row(y);
    for (int x = 0; x < half.width(); ++x)
      out[x] = static_cast<std::uint8_t>((upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1] + 2) / 4);
  }
  return half;
}

}  // namespace

void GreyJpeg::Close::operator()(void* handle) const { tjDestroy(handle); }

GreyJpeg::GreyJpeg() : encoder_(tjInitCompress()) {}

std::string GreyJpeg::encode(const Image& image) {
  if (image.width() > kMostWidth_px) return encode(halved(image));
  if (!encoder_ || image.empty()) return {};
  std::string bytes(tjBufSize(image.width(), image.height(), TJSAMP_GRAY), '\0');
  unsigned long size = bytes.size();
  auto* to = reinterpret_cast<unsigned char*>(bytes.data());
  const ImageView view = image.view();
  if (tjCompress2(encoder_.get(), view.data, view.width, static_cast<int>(view.stride), view.height, TJPF_GRAY, &to, &size,
                  TJSAMP_GRAY, kQuality, TJFLAG_NOREALLOC | TJFLAG_FASTDCT) != 0)
    return {};
  bytes.resize(size);
  return bytes;
}

}  // namespace fbvins
