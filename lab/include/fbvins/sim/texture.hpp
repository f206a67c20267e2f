// SPDX-License-Identifier: Apache-2.0
// Square 8-bit textures with mip-maps, laid out for fast filtering. Immutable once made, any thread.
//
// Each stored word holds the four neighbours that a bilinear look-up needs (own texel in the low byte,
// then right, below, below right; edges wrap around), so that a look-up is one load.
#pragma once

#include <cstdint>
#include <vector>

namespace fbvins {

inline constexpr int kTextureLevels = 10;  ///< 512, 256, ..., 1 texels a side
inline constexpr int kTextureSize = 1 << (kTextureLevels - 1);
/// Words before level l in a texture.
constexpr int mip_offset(int level) {
  const int side = kTextureSize >> level;
  return (4 * kTextureSize * kTextureSize - 4 * side * side) / 3;
}
inline constexpr int kTextureWords = mip_offset(kTextureLevels - 1) + 1;

/// A texture before packing: reflectance 0..1, rows from top to bottom.
struct Canvas {
  std::vector<float> texels = std::vector<float>(static_cast<std::size_t>(kTextureSize) * kTextureSize, 0.5f);

  float& at(int x, int y) { return texels[static_cast<std::size_t>(y) * kTextureSize + static_cast<std::size_t>(x)]; }
  float at(int x, int y) const { return texels[static_cast<std::size_t>(y) * kTextureSize + static_cast<std::size_t>(x)]; }
};

class TextureAtlas {
 public:
  /// Returns the texture's number.
  int add(const Canvas& canvas);
  int size() const { return static_cast<int>(words_.size() / kTextureWords); }
  const std::uint32_t* words(int texture) const { return words_.data() + static_cast<std::size_t>(texture) * kTextureWords; }
  /// Mean reflectance, 0..1.
  float mean(int texture) const { return static_cast<float>(words(texture)[kTextureWords - 1] & 255u) / 255.0f; }

 private:
  std::vector<std::uint32_t> words_;
};

}  // namespace fbvins
