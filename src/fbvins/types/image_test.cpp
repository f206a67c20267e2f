// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/image.hpp"

#include <gtest/gtest.h>

#include <array>

namespace fbvins {
namespace image_test {

using Pixels = std::array<std::uint8_t, 6>;

std::shared_ptr<const std::uint8_t> keeper_of(Pixels& pixels, int& released) {
  return {pixels.data(), [&released](const std::uint8_t*) { ++released; }};
}

TEST(Image, ReadsForeignPixelsInPlaceAndLetsThemGoWithTheLastCopy) {
  Pixels pixels = {1, 2, 3, 4, 5, 6};
  int released = 0;
  {
    auto image = std::make_unique<const Image>(3, 2, keeper_of(pixels, released));
    EXPECT_EQ(image->view().data, pixels.data());
    EXPECT_EQ(image->row(1), pixels.data() + 3);
    EXPECT_EQ(image->at(2, 1), 6);
    EXPECT_FALSE(image->empty());
    const Image copy = *image;
    image.reset();
    EXPECT_EQ(released, 0);
    EXPECT_EQ(copy.at(0, 0), 1);
  }
  EXPECT_EQ(released, 1);
}

TEST(Image, OfForeignPixelsIsCopiedAtTheFirstWrite) {
  Pixels pixels = {1, 2, 3, 4, 5, 6};
  int released = 0;
  Image image(3, 2, keeper_of(pixels, released));
  image.at(1, 0) = 99;
  EXPECT_EQ(released, 1);
  EXPECT_FALSE(image.foreign());
  EXPECT_EQ(pixels[1], 2);
  const Image& written = image;
  EXPECT_EQ(written.at(1, 0), 99);
  EXPECT_EQ(written.at(2, 1), 6);
}

TEST(Image, OwnPixelsAreCopiedWithIt) {
  Image image(3, 2, 7);
  const Image copy = image;
  image.at(0, 1) = 9;
  EXPECT_EQ(copy.at(0, 1), 7);
  EXPECT_NE(copy.view().data, image.view().data);
  EXPECT_TRUE(Image().empty());
}

}  // namespace image_test
}  // namespace fbvins
