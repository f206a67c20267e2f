// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/pyramid.hpp"

#include <gtest/gtest.h>

#include "tests/support/noise_texture.hpp"

namespace fbvins {
namespace pyramid_test {

TEST(Pyramid, LevelsAreBinomialMeansOfEverySecondPixel) {
  const NoiseTexture texture(3);
  const Image image = render_texture(
      101, 67, texture, [](const Vec2& p) { return p; }, 120, 40);
  Pyramid pyramid;
  pyramid.build(image.view(), 3);
  ASSERT_EQ(pyramid.levels(), 3);
  EXPECT_EQ(pyramid.level(1).width, 51);
  EXPECT_EQ(pyramid.level(1).height, 34);
  const int k[5] = {1, 4, 6, 4, 1};
  for (int y = 0; y < 34; ++y) {
    for (int x = 0; x < 51; ++x) {
      int sum = 128;
      for (int j = 0; j < 5; ++j)
        for (int i = 0; i < 5; ++i)
          sum += k[i] * k[j] * image.at(std::clamp(2 * x + i - 2, 0, 100), std::clamp(2 * y + j - 2, 0, 66));
      ASSERT_EQ(pyramid.level(1).row(y)[x], sum >> 8) << x << ' ' << y;
    }
  }
}

TEST(Pyramid, BordersRepeatTheEdge) {
  const NoiseTexture texture(4);
  const Image image = render_texture(
      64, 48, texture, [](const Vec2& p) { return p; }, 120, 40);
  Pyramid pyramid;
  pyramid.build(image.view(), 2);
  for (int l = 0; l < 2; ++l) {
    const PyramidLevel& level = pyramid.level(l);
    for (int y = -kPyramidBorder; y < level.height + kPyramidBorder; ++y)
      for (int x = -kPyramidBorder; x < level.width + kPyramidBorder; ++x)
        ASSERT_EQ(level.row(y)[x], level.row(std::clamp(y, 0, level.height - 1))[std::clamp(x, 0, level.width - 1)]);
  }
}

TEST(Pyramid, SmallImagesHaveFewerLevelsAndEmptyOnesNone) {
  Pyramid pyramid;
  pyramid.build(Image(40, 40).view(), 4);
  EXPECT_EQ(pyramid.levels(), 2);
  pyramid.build(ImageView{}, 4);
  EXPECT_TRUE(pyramid.empty());
  EXPECT_EQ(mean_brightness(pyramid), 0);
  pyramid.build(Image(64, 64, 77).view(), 4);
  EXPECT_NEAR(mean_brightness(pyramid), 77, 1e-9);
}

}  // namespace pyramid_test
}  // namespace fbvins
