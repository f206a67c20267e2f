// SPDX-License-Identifier: Apache-2.0
// camera_info files given with a bag that has the cameras' places.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "fbvins/bags/calibration.hpp"
#include "fbvins/bags/recording.hpp"
#include "fbvins/bags/ros1_bag_writer.hpp"

namespace fbvins {
namespace camera_info_files_test {

namespace fs = std::filesystem;

class CameraInfoFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    rig_.cameras.assign(2, {Camera(PinholeRadtan{90, 91, 40, 30, 0.1, 0.2, 0.01, 0.02}, 80, 60), {}});
    rig_.cameras[0].T_BC = {so3_exp({0.1, -0.2, 1.5}), {0.01, -0.02, 0.03}};
    rig_.cameras[1].T_BC = rig_.T_BC0() * Pose<C0, C0>(Quat::Identity(), Vec3(0.1, 0, 0));
    auto bag = Ros1BagWriter::create(bag_path(), rig_, Time{1'000'000'000});
    ASSERT_TRUE(bag) << bag.error().message;
    const auto image = std::make_shared<const Image>(80, 60, std::uint8_t{90});
    for (std::int64_t i = 0; i < 60; ++i) {
      const Time t{1'000'000'000 + 5'000'000 * i};
      ASSERT_TRUE(bag->add(ImuSample{t, Vec3(1e-6 * static_cast<double>(i), 0, 0), Vec3(0, 0, 9.81)}));
      if (i % 10 == 5) {
        ASSERT_TRUE(bag->add(StereoFrame{t, {image, image}}));
      }
    }
    ASSERT_TRUE(bag->finish());
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string bag_path() const { return (folder_ / "flight.bag").string(); }
  std::string file(const std::string& name, double fx) const {
    std::ofstream(folder_ / name) << fmt::format(
        "image_width: 80\nimage_height: 60\ncamera_matrix: {{data: [{}, 0, 41, 0, 89, 31, 0, 0, 1]}}\ndistortion_model: plumb_bob\n"
        "distortion_coefficients: {{data: [-0.05, 0.05, 0, 0, 0]}}\nrectification_matrix: {{data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}}\n"
        "projection_matrix: {{data: [85, 0, 40, 0, 0, 85, 30, 0, 0, 0, 1, 0]}}\n",
        fx);
    return (folder_ / name).string();
  }

  fs::path folder_ = fs::temp_directory_path() / fmt::format("fbvins_camera_info_{}", ::getpid());
  StereoRig rig_;
};

TEST_F(CameraInfoFiles, HaveTheLensesAndTheBagThePlaces) {
  const std::string both = file("left.yaml", 88) + "," + file("right.yaml", 87);
  EXPECT_TRUE(is_camera_info(both));
  const auto data = open_recording(bag_path(), {.calibration = both});
  ASSERT_TRUE(data) << data.error().message;
  const StereoRig& rig = (*data)->rig();
  EXPECT_EQ(rig.left().intrinsics()[0], 88);
  EXPECT_EQ(rig.right().intrinsics()[0], 87);
  EXPECT_LT((rig.T_BC0().p - rig_.T_BC0().p).norm() + (rig.T_BC1().p - rig_.T_BC1().p).norm(), 1e-9);
}

TEST_F(CameraInfoFiles, AreAsManyAsCameras) {
  const std::string one = file("left.yaml", 88);
  const auto data = open_recording(bag_path(), {.calibration = one});
  ASSERT_FALSE(data);
  EXPECT_NE(data.error().message.find("1 camera_info files for 2 cameras"), std::string::npos) << data.error().message;
  const auto left = open_recording(bag_path(), {.calibration = one, .topics = {bag_camera_topic(0)}});
  ASSERT_TRUE(left) << left.error().message;
  EXPECT_EQ((*left)->rig().left().intrinsics()[0], 88);
  EXPECT_FALSE((*left)->rig().has_right());
  EXPECT_FALSE(open_recording(bag_path(), {.calibration = (folder_ / "none.yaml").string()}));
}

}  // namespace camera_info_files_test
}  // namespace fbvins
