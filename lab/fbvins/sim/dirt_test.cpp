// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/dirt.hpp"

#include <gtest/gtest.h>

#include "fbvins/camera/mask.hpp"

namespace fbvins {
namespace dirt_test {

constexpr int kWidth = 376, kHeight = 240;

TEST(Dirt, CoversAPartOfTheImageElsewhereInEachFlight) {
  for (std::uint64_t seed = 1; seed < 5; ++seed) {
    const double share = Mask(Dirt(kWidth, kHeight, 3, seed).seen()).hidden_share();
    EXPECT_GT(share, 0.003) << seed;
    EXPECT_LT(share, 0.12) << seed;
  }
  EXPECT_NE(Mask(Dirt(kWidth, kHeight, 3, 1).seen()).rectangles(), Mask(Dirt(kWidth, kHeight, 3, 2).seen()).rectangles());
}

TEST(Dirt, LetsSomeOfTheSceneShineThrough) {
  const Dirt dirt(kWidth, kHeight, 2, 3);
  const Image seen = dirt.seen();
  // Two scenes of the same mean.
  std::vector<float> plain(kWidth * kHeight, 0.25f), striped(plain);
  for (int i = 0; i < kWidth * kHeight; ++i) striped[static_cast<std::size_t>(i)] = i % 2 == 0 ? 0.2f : 0.3f;
  dirt.draw(plain);
  dirt.draw(striped);
  int darker = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto i = static_cast<std::size_t>(y * kWidth + x);
      const float shines = std::abs(striped[i] - plain[i]) / 0.05f;
      if (seen.at(x, y) == 0) {
        EXPECT_LE(shines, 0.501f);
        EXPECT_GT(shines, 0.0f);
        ++darker;
      } else {
        EXPECT_GE(shines, 0.499f);
      }
    }
  EXPECT_GT(darker, 100);
}

}  // namespace dirt_test
}  // namespace fbvins
