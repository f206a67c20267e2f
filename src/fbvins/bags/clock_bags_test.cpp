// SPDX-License-Identifier: Apache-2.0
// Bags whose clock does not run on.
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "fbvins/bags/recording.hpp"
#include "fbvins/bags/ros1_bag_writer.hpp"

namespace fbvins {
namespace clock_bags_test {

constexpr std::int64_t kMs = 1'000'000, kWrap = 4'294'967'296'000;

/// Four seconds, whose stamps are `stamp(ms)`; the images' `image_stamp(ms)`.
std::string bag_with(const std::string& name, const std::function<std::int64_t(std::int64_t)>& stamp,
                     const std::function<std::int64_t(std::int64_t)>& image_stamp) {
  const std::string path = (std::filesystem::path(::testing::TempDir()) / ("fbvins_clock_" + name + ".bag")).string();
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{90, 91, 40, 30, 0.1, 0.2, 0.01, 0.02}, 80, 60), {}});
  rig.cameras[1].T_BC.p.x() = 0.1;
  auto bag = Ros1BagWriter::create(path, rig, Time{1000 * kMs});
  EXPECT_TRUE(bag.ok());
  const auto image = std::make_shared<const Image>(80, 60, std::uint8_t{90});
  for (std::int64_t ms = 0; ms < 4000; ms += 5) {
    EXPECT_TRUE(bag->add(ImuSample{Time{stamp(ms)}, Vec3(0.001 * static_cast<double>(ms), 0, 0), Vec3(0, 0, 9.81)}).ok());
    if (ms % 50 == 25) {
      EXPECT_TRUE(bag->add(StereoFrame{Time{image_stamp(ms)}, {image, image}}).ok());
    }
  }
  EXPECT_TRUE(bag->finish().ok());
  return path;
}

struct Read {
  int frames = 0, readings = 0, marked = 0, said = 0;
  bool in_order = true;
};

Read read_back(const std::string& path, const std::string& words) {
  Read out;
  auto data = open_recording(path);
  EXPECT_TRUE(data.ok()) << data.error().message;
  if (!data) return out;
  for (const std::string& warning : (*data)->info().warnings) out.said += warning.find(words) != std::string::npos;
  Time newest{-1};
  while (auto event = (*data)->next()) {
    const auto* frame = std::get_if<StereoFrame>(&*event);
    if (!frame && ++out.readings > 0) continue;
    ++out.frames;
    out.marked += frame->after_clock_step;
    out.in_order &= frame->t > newest;
    newest = frame->t;
  }
  std::filesystem::remove(path);
  return out;
}

TEST(ClockBags, AClockThatIsSetBackBeginsANewPart) {
  const auto stamp = [](std::int64_t ms) { return (100'000 + ms - (ms >= 2000 ? 700 : 0)) * kMs; };
  const Read all = read_back(bag_with("back", stamp, stamp), "the sensors' clock was set back by 0.7");
  EXPECT_EQ(all.frames, 80);
  EXPECT_EQ(all.readings, 800);
  EXPECT_EQ(all.marked, 1);
  EXPECT_EQ(all.said, 1);
  EXPECT_TRUE(all.in_order);
}

TEST(ClockBags, PartsThatWereWrittenInAnotherOrderAreReadInThatOfTheirRecording) {
  const auto stamp = [](std::int64_t ms) { return (100'000 + (ms < 1000 ? ms : ms < 2000 ? ms + 2000 : ms - 1000)) * kMs; };
  const Read all = read_back(bag_with("parts", stamp, stamp), "clock");
  EXPECT_EQ(all.frames, 80);
  EXPECT_EQ(all.readings, 800);
  EXPECT_EQ(all.marked, 0);
  EXPECT_EQ(all.said, 0);
  EXPECT_TRUE(all.in_order);
}

TEST(ClockBags, ADeviceThatStartsAgain) {
  const auto stamp = [](std::int64_t ms) { return (ms >= 2000 ? 50 + ms - 2000 : 5'000'000 + ms) * kMs; };
  const Read all = read_back(bag_with("restart", stamp, stamp), "or the device started again");
  EXPECT_EQ(all.frames, 80);
  EXPECT_EQ(all.readings, 800);
  EXPECT_EQ(all.marked, 1);
  EXPECT_EQ(all.said, 1);
}

TEST(ClockBags, ACounterThatWrapsGoesOn) {
  const auto stamp = [](std::int64_t ms) { return (kWrap - 2001 * kMs + ms * kMs) % kWrap + 1; };
  const Read all = read_back(bag_with("wrap", stamp, stamp), "a counter of 32 bits of microseconds began again");
  EXPECT_EQ(all.frames, 80);
  EXPECT_EQ(all.readings, 800);
  EXPECT_EQ(all.marked, 0);
  EXPECT_EQ(all.said, 3) << "for each topic";
}

TEST(ClockBags, ImagesAloneThatStepBackEndTheRecording) {
  const auto image = [](std::int64_t ms) { return (100'000 + ms - (ms >= 2000 ? 700 : 0)) * kMs; };
  const Read all = read_back(bag_with(
                                 "images", [](std::int64_t ms) { return (100'000 + ms) * kMs; }, image),
                             "cannot be put in time");
  EXPECT_EQ(all.frames, 40);
  EXPECT_EQ(all.marked, 0);
  EXPECT_EQ(all.said, 1);
}

}  // namespace clock_bags_test
}  // namespace fbvins
