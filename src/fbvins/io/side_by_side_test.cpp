// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/side_by_side.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "fbvins/io/dataset.hpp"
#include "fbvins/io/euroc_folder.hpp"
#include "fbvins/io/png_encode.hpp"

namespace fbvins {
namespace side_by_side_test {

namespace fs = std::filesystem;
constexpr int kWidth = 64, kHeight = 48;

StereoRig rig_of_two() {
  StereoRig rig;
  rig.cameras.resize(2);
  rig.cameras[0].camera = Camera(PinholeRadtan{40, 41, 31.5, 23.5, -0.25, 0.0625, 0.001, -0.002}, kWidth, kHeight);
  rig.cameras[1].camera = Camera(PinholeRadtan{42, 43, 32.5, 22.5, -0.125, 0.03125, 0, 0}, kWidth, kHeight);
  rig.cameras[1].T_BC = {Quat::Identity(), Vec3(0.1, 0, 0)};
  return rig;
}

/// Three images, each of which has both: the left camera's grey values are 10, the right one's 200.
std::string recording(const std::string& name, int width = 2 * kWidth) {
  const std::string folder = ::testing::TempDir() + "/fbvins_" + name;
  fs::remove_all(folder);
  auto writer = EurocFolder::create(folder, rig_of_two(), "made by hand");
  EXPECT_TRUE(writer.ok());
  std::vector<ImuSample> readings;
  for (int i = 0; i < 60; ++i) readings.push_back({Time{1'000'000'000 + i * 5'000'000}, Vec3::Zero(), Vec3(0, 0, 9.81)});
  const auto blank = std::make_shared<const Image>(kWidth, kHeight);
  for (int i = 0; i < 3; ++i)
    EXPECT_TRUE(writer->add({Time{1'020'000'000 + i * 50'000'000}, {blank, blank}}, Time{1'020'000'000 + i * 50'000'000}).ok());
  EXPECT_TRUE(writer->finish(readings, {}).ok());
  Image both(width, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < width; ++x) both.at(x, y) = 2 * x < width ? 10 : 200;
  const std::string png = encode_png(both);
  for (const auto& file : fs::directory_iterator(folder + "/mav0/cam0/data"))
    std::ofstream(file.path(), std::ios::binary).write(png.data(), std::ssize(png));
  fs::remove(folder + "/mav0/cam1/data.csv");
  fs::remove_all(folder + "/mav0/cam1/data");
  return folder;
}

void expect_split(const Result<std::unique_ptr<Dataset>>& data) {
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ((*data)->rig().camera_count(), 2);
  ASSERT_FALSE((*data)->info().warnings.empty());
  EXPECT_NE((*data)->info().warnings[0].find("two side by side"), std::string::npos) << (*data)->info().warnings[0];
  int frames = 0;
  while (auto event = (*data)->next())
    if (const auto* frame = std::get_if<StereoFrame>(&*event)) {
      ASSERT_TRUE(frame->left() && frame->right());
      EXPECT_EQ(frame->left()->width(), kWidth);
      EXPECT_EQ(frame->left()->at(kWidth - 1, 5), 10);
      EXPECT_EQ(frame->right()->at(0, 5), 200);
      ++frames;
    }
  EXPECT_EQ(frames, 3);
}

TEST(SideBySide, AFolderWithTheCalibrationOfBothIsSplit) { expect_split(open_dataset(recording("beside_own"))); }

TEST(SideBySide, ACalibrationOfTwoThatIsGivenSplitsTheOnlyCamera) {
  const std::string folder = recording("beside_given");
  fs::remove_all(folder + "/mav0/cam1");
  DatasetOptions options;
  options.rig = rig_of_two();
  expect_split(open_dataset(folder, options));
}

TEST(SideBySide, OtherWidthsAreNotTaken) {
  EXPECT_FALSE(open_dataset(recording("beside_other", 2 * kWidth + 2))) << "cam1's images are missing";
  EXPECT_TRUE(is_side_by_side(128, 48, rig_of_two()));
  EXPECT_FALSE(is_side_by_side(64, 48, rig_of_two()));
  EXPECT_FALSE(is_side_by_side(128, 24, rig_of_two()));
  StereoRig one = rig_of_two();
  one.cameras.pop_back();
  EXPECT_FALSE(is_side_by_side(128, 48, one));
}

}  // namespace side_by_side_test
}  // namespace fbvins
