// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <unistd.h>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "fbvins/bags/bag_contents.hpp"
#include "fbvins/bags/grey_image.hpp"
#include "fbvins/bags/recording.hpp"
#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;

class Bags : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("fbvins_bags_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const char* name) const { return (folder_ / name).string(); }

  static StereoRig rig() {
    StereoRig rig;
    rig.left = Camera(PinholeRadtan{90, 91, 40, 30, 0.1, 0.2, 0.01, 0.02}, 80, 60);
    rig.right = Camera(PinholeRadtan{92, 93, 41, 31, 0.1, 0.2, 0.01, 0.02}, 80, 60);
    rig.T_BC0 = {so3_exp({0.1, -0.2, 1.5}), {0.01, -0.02, 0.03}};
    rig.T_BC1 = {so3_exp({0.12, -0.19, 1.49}), {0.01, 0.09, 0.03}};
    return rig;
  }
  static std::shared_ptr<const Image> image(int number) {
    auto out = std::make_shared<Image>(80, 60);
    for (int y = 0; y < 60; ++y)
      for (int x = 0; x < 80; ++x) out->at(x, y) = static_cast<std::uint8_t>(x + 3 * y + number);
    return out;
  }
  /// Twenty frames, ten readings each.
  void write(const std::string& file) const {
    auto bag = Ros1BagWriter::create(file, rig(), Time{1'000'000'000});
    ASSERT_TRUE(bag) << bag.error().message;
    for (int i = 0; i < 200; ++i) {
      const Time t{1'000'000'000 + 5'000'000 * static_cast<std::int64_t>(i)};
      ASSERT_TRUE(bag->add(ImuSample{t, Vec3(0.1 * i, 0, 1e-9), Vec3(0, 9.81, i)}));
      if (i % 10 != 5) continue;
      ASSERT_TRUE(bag->add(StereoFrame{t, image(i), image(i + 1)}));
    }
    ASSERT_TRUE(bag->finish());
  }
  fs::path folder_;
};

std::string bytes_of(const std::string& file) {
  std::ostringstream out;
  out << std::ifstream(file, std::ios::binary).rdbuf();
  return out.str();
}

TEST_F(Bags, WhatIsWrittenIsRead) {
  write(path("flight.bag"));
  auto data = open_recording(path("flight.bag"));
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ((*data)->info().frames, 20);
  EXPECT_EQ((*data)->info().imu_samples, 200);
  EXPECT_LT(((*data)->rig().T_BC1.R() - rig().T_BC1.R()).norm(), 1e-12);
  EXPECT_EQ(std::get<PinholeRadtan>((*data)->rig().right.model()).p2, 0.02);
  int readings = 0, frames = 0;
  while (auto event = (*data)->next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*event)) {
      EXPECT_EQ(sample->gyro_radps, Vec3(0.1 * readings, 0, 1e-9));
      EXPECT_EQ(sample->accel_mps2.z(), readings++);
      continue;
    }
    const auto& frame = std::get<StereoFrame>(*event);
    EXPECT_EQ(frame.left->at(7, 11), image(5 + 10 * frames)->at(7, 11));
    EXPECT_EQ(frame.right->at(79, 59), image(6 + 10 * frames++)->at(79, 59));
  }
  EXPECT_EQ(readings, 200);
  EXPECT_EQ(frames, 20);
}

/// What comes before the cut is there, whatever the place, and more of it the later the cut.
TEST_F(Bags, ABagCutOffAnywhereIsReadAsFarAsItIsWhole) {
  write(path("flight.bag"));
  const std::string whole = bytes_of(path("flight.bag"));
  Rng rng(1, 2);
  for (int i = 0; i < 200; ++i) {
    const auto length = static_cast<std::size_t>(rng.uniform() * static_cast<double>(whole.size()));
    auto bag = read_ros1_bag(bytes_in_memory(whole.substr(0, length)), "cut.bag");
    if (length < 13) {
      EXPECT_FALSE(bag);
      continue;
    }
    ASSERT_TRUE(bag) << bag.error().message;
    const BagContents contents = read_contents(**bag);
    const std::size_t readings = contents.imu.empty() ? 0 : contents.imu.at("/imu0").samples.size();
    EXPECT_TRUE((*bag)->damage().ends_early) << length;
    EXPECT_EQ((*bag)->damage().parts, 0) << (*bag)->damage().first;
    EXPECT_GE(readings + 40, 200 * length / whole.size()) << length;
  }
}

TEST_F(Bags, BytesThatAreWrongAreLeftOutOrRefused) {
  write(path("flight.bag"));
  const std::string whole = bytes_of(path("flight.bag"));
  Rng rng(3, 4);
  for (int i = 0; i < 300; ++i) {
    std::string broken = whole;
    for (int k = 0; k < 8; ++k)
      broken[static_cast<std::size_t>(rng.uniform() * static_cast<double>(i % 2 == 0 ? broken.size() : 6000))] =
          static_cast<char>(256 * rng.uniform());
    std::ofstream(path("broken.bag"), std::ios::binary) << broken;
    auto data = open_recording(path("broken.bag"));
    if (!data) {
      EXPECT_EQ(data.error().message.find('\n'), std::string::npos);
      continue;
    }
    while (auto event = (*data)->next()) {
    }
  }
}

TEST_F(Bags, TopicsThatCannotBeFoundAreListed) {
  write(path("flight.bag"));
  EXPECT_EQ(open_recording(path("flight.bag"), {.left_topic = "/left", .right_topic = "/cam1/image_raw"}).error().message,
            path("flight.bag") + ": there is no image on '/left'; there are /cam0/image_raw, /cam1/image_raw");
  EXPECT_EQ(open_recording(path("flight.bag"), {.left_topic = "/left"}).error().message,
            path("flight.bag") + ": one image topic is named and the other is not");
  const auto swapped = open_recording(path("flight.bag"), {.left_topic = "/cam1/image_raw", .right_topic = "/cam0/image_raw"});
  ASSERT_TRUE(swapped) << swapped.error().message;
  EXPECT_EQ((*swapped)->rig().left.focal_px(), 92.5);
}

TEST(BagContents, NamesOfTopicsDoNotBreakASentence) {
  BagContents contents;
  contents.images["/a\n"], contents.images["/b"], contents.images["/c"];
  EXPECT_EQ(choose_topics(contents, {}, true).error().message, "has 3 image topics (/a?, /b, /c): say which are left and right");
}

std::string grey_of(std::string_view encoding, std::uint32_t width, std::uint32_t step, std::string_view pixels,
                    bool big_endian = false) {
  const auto image = grey_image({width, static_cast<std::uint32_t>(pixels.size() / step), step, encoding, big_endian, pixels});
  if (!image) return image.error().message;
  std::string out;
  for (int y = 0; y < image->height(); ++y)
    out.append(reinterpret_cast<const char*>(image->row(y)), static_cast<std::size_t>(image->width()));
  return out;
}

TEST(GreyImage, EveryEncodingBecomesBrightness) {
  EXPECT_EQ(grey_of("mono8", 2, 3, "ab_cd_"), "abcd");
  EXPECT_EQ(grey_of("mono16", 2, 4,
                    "\x01"
                    "a"
                    "\x02"
                    "b"),
            "ab");
  EXPECT_EQ(grey_of("mono16", 2, 4,
                    "a\x01"
                    "b\x02",
                    true),
            "ab");
  EXPECT_EQ(grey_of("rgb8", 1, 3, std::string_view("\xff\0\0", 3)), "\x4c");
  EXPECT_EQ(grey_of("bgr8", 1, 3, std::string_view("\xff\0\0", 3)), "\x1d");
  EXPECT_EQ(grey_of("rgba8", 1, 4, "aaaZ"), "a");
  EXPECT_EQ(grey_of("yuv422", 2, 4, "uavb"), "ab");
  EXPECT_EQ(grey_of("jpeg2000", 1, 1, "a"), "images encoded as 'jpeg2000' cannot be read");
  EXPECT_EQ(grey_of("a\nb", 1, 1, "a"), "images encoded as 'a?b' cannot be read");  // one sentence on one line
  EXPECT_EQ(grey_of("mono8", 3, 2, "abcd"), "this image holds fewer pixels than it says");
}

/// Red 40, green 80, blue 120 everywhere: (40 + 2 80 + 120) / 4 at every pixel, at the edges as well.
TEST(GreyImage, AMosaicOfOneColourIsOneGrey) {
  std::string pixels;
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 8; ++x) pixels += static_cast<char>(y % 2 == 0 ? (x % 2 == 0 ? 40 : 80) : (x % 2 == 0 ? 80 : 120));
  EXPECT_EQ(grey_of("bayer_rggb8", 8, 8, pixels), std::string(48, 'P'));
}

}  // namespace
}  // namespace fbvins
