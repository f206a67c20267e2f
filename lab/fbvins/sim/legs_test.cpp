// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/legs.hpp"

#include <gtest/gtest.h>

#include "fbvins/camera/mask.hpp"

namespace fbvins {
namespace legs_test {

constexpr int kWidth = 376, kHeight = 240;

TEST(Legs, StandInTheLowerPartOfTheImage) {
  for (int camera = 0; camera < 4; ++camera) {
    const Mask mask(Legs(kWidth, kHeight, 3, camera).seen());
    EXPECT_GT(mask.hidden_share(), 0.02);
    EXPECT_LT(mask.hidden_share(), 0.15);
    EXPECT_FALSE(mask.hides({kWidth / 2, kHeight / 8}, kHeight / 8));
  }
}

TEST(Legs, AreElsewhereInEachCamera) {
  EXPECT_NE(Mask(Legs(kWidth, kHeight, 3, 0).seen()).rectangles(), Mask(Legs(kWidth, kHeight, 3, 1).seen()).rectangles());
}

TEST(Legs, ArePaintedAtTheSamePixelsAndLitByWhatIsInView) {
  const Legs legs(kWidth, kHeight, 2, 0);
  const Image seen = legs.seen();
  std::vector<float> dark(kWidth * kHeight, 0.1f), bright(kWidth * kHeight, 0.4f);
  legs.draw(dark);
  legs.draw(bright);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto i = static_cast<std::size_t>(y * kWidth + x);
      if (seen.at(x, y) != 0) EXPECT_EQ(dark[i], 0.1f);
      else EXPECT_NEAR(bright[i], 4 * dark[i], 1e-4f);
    }
}

}  // namespace legs_test
}  // namespace fbvins
