// SPDX-License-Identifier: Apache-2.0
// Images are made with the libraries' own writers; what real files hold is checked in dataset_test.cpp.
#include "fbvins/io/image_decode.hpp"

#include <gtest/gtest.h>
#include <png.h>
#include <turbojpeg.h>

namespace fbvins {
namespace image_decode_test {

void append_bytes(png_structp png, png_bytep data, size_t size) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(data), size);
}

/// rows: big-endian samples as they lie in the file.
std::string write_png(int width, int height, int depth, int colour_type, const std::vector<std::uint8_t>& bytes,
                      bool interlaced = false, const std::vector<png_color>& palette = {}) {
  std::string out;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(png, &out, append_bytes, nullptr);
  png_set_IHDR(png, info, width, height, depth, colour_type, interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (!palette.empty()) png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  png_write_info(png, info);
  const std::size_t stride = bytes.size() / height;
  const int passes = png_set_interlace_handling(png);
  for (int pass = 0; pass < passes; ++pass)
    for (int y = 0; y < height; ++y) png_write_row(png, bytes.data() + y * stride);
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return out;
}

std::vector<std::uint8_t> ramp(int count) {
  std::vector<std::uint8_t> out;
  for (int i = 0; i < count; ++i) out.push_back(static_cast<std::uint8_t>(37 * i));
  return out;
}

TEST(DecodePng, EightBitGreyIsExact) {
  for (bool interlaced : {false, true}) {
    const auto image = decode_image(write_png(13, 7, 8, PNG_COLOR_TYPE_GRAY, ramp(13 * 7), interlaced));
    ASSERT_TRUE(image) << image.error().message;
    ASSERT_EQ(image->width(), 13);
    ASSERT_EQ(image->height(), 7);
    for (int y = 0; y < 7; ++y)
      for (int x = 0; x < 13; ++x) EXPECT_EQ(image->at(x, y), static_cast<std::uint8_t>(37 * (13 * y + x)));
  }
}

TEST(DecodeDepth, SixteenBitIsExact) {
  for (bool interlaced : {false, true}) {
    const auto image = decode_depth(write_png(3, 1, 16, PNG_COLOR_TYPE_GRAY, {0x04, 0xD2, 0xFF, 0xFF, 0, 0}, interlaced));
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->width, 3);
    EXPECT_EQ(image->height, 1);
    EXPECT_EQ(image->mm, (std::vector<std::uint16_t>{1234, 65535, 0}));
  }
}

TEST(DecodeDepth, WhatIsNoDepthImageIsRefused) {
  const std::string good = write_png(3, 1, 16, PNG_COLOR_TYPE_GRAY, {0x04, 0xD2, 0xFF, 0xFF, 0, 0});
  EXPECT_FALSE(decode_depth(""));
  EXPECT_FALSE(decode_depth("P5 3 1 65535"));
  EXPECT_FALSE(decode_depth(good.substr(0, good.size() - 20)));
  const auto grey = decode_depth(write_png(3, 1, 8, PNG_COLOR_TYPE_GRAY, ramp(3)));
  ASSERT_FALSE(grey);
  EXPECT_NE(grey.error().message.find("1 channels of 8 bits"), std::string::npos) << grey.error().message;
  EXPECT_FALSE(decode_depth(write_png(1, 1, 16, PNG_COLOR_TYPE_RGB, ramp(6))));
}

TEST(DecodePng, SixteenBitIsScaled) {
  const auto image = decode_image(write_png(3, 1, 16, PNG_COLOR_TYPE_GRAY, {0x80, 0x80, 0xFF, 0xFF, 0x12, 0x00}));
  ASSERT_TRUE(image);
  EXPECT_EQ(image->at(0, 0), 0x80);
  EXPECT_EQ(image->at(1, 0), 0xFF);
  EXPECT_EQ(image->at(2, 0), 0x12);
}

TEST(DecodePng, OfTenAndTwelveBitsTheUpperEightAreKept) {
  const std::string grey = write_png(3, 1, 16, PNG_COLOR_TYPE_GRAY, {0x0F, 0xF0, 0x01, 0x23, 0x10, 0x00});
  const std::string rgb = write_png(1, 1, 16, PNG_COLOR_TYPE_RGB, {0x0A, 0xB0, 0x0A, 0xB0, 0x0A, 0xB0});
  EXPECT_EQ(largest_value_of_png(grey), 0x1000);
  EXPECT_EQ(largest_value_of_png(rgb), 0x0AB0);
  EXPECT_FALSE(largest_value_of_png(write_png(3, 1, 8, PNG_COLOR_TYPE_GRAY, ramp(3))));
  EXPECT_FALSE(largest_value_of_png(grey.substr(0, grey.size() - 20)));
  EXPECT_FALSE(largest_value_of_png("P5 3 1 255"));
  const auto twelve = decode_image(grey, 12);
  ASSERT_TRUE(twelve) << twelve.error().message;
  EXPECT_EQ(twelve->at(0, 0), 0xFF);
  EXPECT_EQ(twelve->at(1, 0), 0x12);
  EXPECT_EQ(twelve->at(2, 0), 0xFF) << "brighter than the images that were tried";
  EXPECT_EQ(decode_image(rgb, 12)->at(0, 0), 0xAB);
  EXPECT_EQ(decode_image(write_png(3, 1, 8, PNG_COLOR_TYPE_GRAY, ramp(3)), 12)->at(1, 0), 37) << "eight bits are as they are";
  EXPECT_EQ(decode_image(write_png(2, 1, 8, PNG_COLOR_TYPE_GRAY_ALPHA, {77, 0, 88, 255}), 12)->at(1, 0), 88);
  for (std::size_t length = 0; length < grey.size(); ++length) EXPECT_FALSE(decode_image(grey.substr(0, length), 12)) << length;
}

TEST(DecodePng, ColourBecomesLuma) {
  const std::vector<std::uint8_t> rgb = {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255, 100, 100, 100};
  const auto image = decode_image(write_png(5, 1, 8, PNG_COLOR_TYPE_RGB, rgb));
  ASSERT_TRUE(image);
  const int expected[] = {76, 150, 29, 255, 100};
  for (int x = 0; x < 5; ++x) EXPECT_EQ(image->at(x, 0), expected[x]);
}

TEST(DecodePng, PaletteBitsAndTransparencyAreUnfolded) {
  const auto palette = decode_image(write_png(2, 1, 8, PNG_COLOR_TYPE_PALETTE, {1, 0}, false, {{10, 10, 10}, {200, 200, 200}}));
  ASSERT_TRUE(palette) << palette.error().message;
  EXPECT_EQ(palette->at(0, 0), 200);
  EXPECT_EQ(palette->at(1, 0), 10);
  const auto bits = decode_image(write_png(4, 1, 1, PNG_COLOR_TYPE_GRAY, {0b10100000}));
  ASSERT_TRUE(bits);
  EXPECT_EQ(bits->at(0, 0), 255);
  EXPECT_EQ(bits->at(1, 0), 0);
  const auto alpha = decode_image(write_png(2, 1, 8, PNG_COLOR_TYPE_GRAY_ALPHA, {77, 0, 88, 255}));
  ASSERT_TRUE(alpha);
  EXPECT_EQ(alpha->at(0, 0), 77);
  EXPECT_EQ(alpha->at(1, 0), 88);
}

TEST(DecodePng, EveryCutIsAnError) {
  const std::string whole = write_png(13, 7, 8, PNG_COLOR_TYPE_GRAY, ramp(13 * 7));
  for (std::size_t length = 0; length < whole.size(); ++length) EXPECT_FALSE(decode_image(whole.substr(0, length))) << length;
}

TEST(DecodePng, AbsurdSizesCostNoMemory) {
  std::string png = write_png(13, 7, 8, PNG_COLOR_TYPE_GRAY, ramp(13 * 7));
  png.replace(16, 4, std::string("\x7f\xff\xff\xff", 4));
  EXPECT_FALSE(decode_image(png));
}

std::string write_jpeg(const std::vector<std::uint8_t>& grey, int width, int height, bool colour) {
  std::vector<std::uint8_t> pixels;
  for (std::uint8_t g : grey)
    for (int c = 0; c < (colour ? 3 : 1); ++c) pixels.push_back(g);
  tjhandle tj = tjInitCompress();
  unsigned char* jpeg = nullptr;
  unsigned long size = 0;
  EXPECT_EQ(tjCompress2(tj, pixels.data(), width, 0, height, colour ? TJPF_RGB : TJPF_GRAY, &jpeg, &size,
                        colour ? TJSAMP_420 : TJSAMP_GRAY, 95, 0),
            0);
  std::string out(reinterpret_cast<const char*>(jpeg), size);
  tjFree(jpeg);
  tjDestroy(tj);
  return out;
}

std::vector<std::uint8_t> slope(int width, int height) {
  std::vector<std::uint8_t> out;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) out.push_back(static_cast<std::uint8_t>(2 * x + y));
  return out;
}

TEST(DecodeJpeg, GreyAndColourComeBackNearly) {
  for (bool colour : {false, true}) {
    const auto image = decode_image(write_jpeg(slope(64, 48), 64, 48, colour));
    ASSERT_TRUE(image) << image.error().message;
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x) EXPECT_NEAR(image->at(x, y), 2 * x + y, 4);
  }
}

TEST(DecodeJpeg, CutOffIsAnError) {
  const std::string whole = write_jpeg(slope(64, 48), 64, 48, false);
  for (std::size_t length = 0; length + 2 < whole.size(); length += 7)
    EXPECT_FALSE(decode_image(whole.substr(0, length))) << length;
}

TEST(DecodeImage, OtherBytesAreRefused) {
  EXPECT_EQ(decode_image("").error().message, "the file is empty");
  EXPECT_EQ(decode_image("GIF89a").error().message, "GIF, neither PNG nor JPEG: write images as PNG");
  EXPECT_EQ(decode_image("BM\x36").error().message.substr(0, 3), "BMP");
  EXPECT_EQ(decode_image("P5\n3 1\n255\n").error().message.substr(0, 3), "PGM");
  EXPECT_EQ(decode_image(std::string_view("MM\0*", 4)).error().message.substr(0, 4), "TIFF");
  EXPECT_EQ(decode_image("GLB").error().message, "neither PNG nor JPEG");
}

}  // namespace image_decode_test
}  // namespace fbvins
