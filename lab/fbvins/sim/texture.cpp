// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/texture.hpp"

#include <algorithm>

namespace fbvins {
namespace {

std::uint32_t to_byte(float x) { return static_cast<std::uint32_t>(std::clamp(x * 255.0f + 0.5f, 0.0f, 255.0f)); }

void pack_level(const std::vector<float>& level, int side, std::uint32_t* words) {
  const auto texel = [&](int x, int y) { return to_byte(level[static_cast<std::size_t>(y % side) * side + x % side]); };
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      *words++ = texel(x, y) | texel(x + 1, y) << 8 | texel(x, y + 1) << 16 | texel(x + 1, y + 1) << 24;
}

std::vector<float> halve(const std::vector<float>& level, int side) {
  std::vector<float> half(static_cast<std::size_t>(side / 2) * (side / 2));
  for (int y = 0; y < side / 2; ++y)
    for (int x = 0; x < side / 2; ++x) {
      const float* p = &level[static_cast<std::size_t>(2 * y) * side + 2 * x];
      half[static_cast<std::size_t>(y) * (side / 2) + x] = 0.25f * (p[0] + p[1] + p[side] + p[side + 1]);
    }
  return half;
}

}  // namespace

int TextureAtlas::add(const Canvas& canvas) {
  const std::size_t first = words_.size();
  words_.resize(first + kTextureWords);
  std::vector<float> level = canvas.texels;
  for (int l = 0, side = kTextureSize; l < kTextureLevels; ++l, side /= 2) {
    pack_level(level, side, &words_[first + static_cast<std::size_t>(mip_offset(l))]);
    if (side > 1) level = halve(level, side);
  }
  return size() - 1;
}

}  // namespace fbvins
