// SPDX-License-Identifier: Apache-2.0
#include "fbvins/v4l2/video_format.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace video_format_test {

/// Pixel (x, y) is 16 y + x, rows of `row_bytes`, each grey value followed or preceded by a colour of 200.
std::vector<std::uint8_t> picture(int step, int first, int row_bytes) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(row_bytes) * 3, 200);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 4; ++x)
      bytes[static_cast<std::size_t>(y * row_bytes + first + x * step)] = static_cast<std::uint8_t>(16 * y + x);
  return bytes;
}

void expect_picture(const Result<Image>& image) {
  ASSERT_TRUE(image) << image.error().message;
  ASSERT_EQ(image->width(), 4);
  ASSERT_EQ(image->height(), 3);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 4; ++x) EXPECT_EQ(image->at(x, y), 16 * y + x);
}

TEST(VideoFormat, FindsTheGreyValues) {
  expect_picture(grey_image({fourcc("GREY"), 4, 3, 4}, picture(1, 0, 4)));
  expect_picture(grey_image({fourcc("GREY"), 4, 3, 7}, picture(1, 0, 7)));
  expect_picture(grey_image({fourcc("NV12"), 4, 3, 4}, picture(1, 0, 4)));
  expect_picture(grey_image({fourcc("YUYV"), 4, 3, 8}, picture(2, 0, 8)));
  expect_picture(grey_image({fourcc("UYVY"), 4, 3, 10}, picture(2, 1, 10)));
}

TEST(VideoFormat, SaysWhatIsMissing) {
  const auto few = picture(1, 0, 4);
  const auto cut = grey_image({fourcc("YUYV"), 4, 3, 8}, few);
  ASSERT_FALSE(cut);
  EXPECT_NE(cut.error().message.find("12 bytes, too few for 4 x 3 pixels of YUYV"), std::string::npos) << cut.error().message;
  EXPECT_FALSE(grey_image({fourcc("GREY"), 4, 3, 3}, few)) << "rows shorter than the image is wide";
  EXPECT_FALSE(grey_image({fourcc("MJPG"), 4, 3, 0}, few)) << "no JPEG";
}

TEST(VideoFormat, CutsImagesSideBySide) {
  Image both(6, 2);
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 6; ++x) both.at(x, y) = static_cast<std::uint8_t>(10 * y + x);
  const std::vector<Image> two = split_side_by_side(both, 2), three = split_side_by_side(both, 3);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two[0].width(), 3);
  EXPECT_EQ(two[0].at(2, 1), 12);
  EXPECT_EQ(two[1].at(0, 1), 13);
  EXPECT_EQ(two[1].at(2, 0), 5);
  ASSERT_EQ(three.size(), 3u);
  EXPECT_EQ(three[2].at(1, 1), 15);
}

TEST(VideoFormat, NamesFormats) { EXPECT_EQ(fourcc_name(fourcc("MJPG")), "MJPG"); }

}  // namespace video_format_test
}  // namespace fbvins
