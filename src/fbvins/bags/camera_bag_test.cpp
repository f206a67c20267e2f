// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/camera_bag.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/bags/topic_choice.hpp"
#include "fbvins/io/flight_record.hpp"

namespace fbvins {
namespace camera_bag_test {

namespace fs = std::filesystem;

StereoRig small_rig() {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{90, 91, 40, 30, 0.1, 0.2, 0.01, 0.02}, 80, 60), {}});
  rig.cameras[1].T_BC.p.y() = 0.1;
  rig.imu_noise.gyro_noise_density_radps_rthz = 3e-4;
  return rig;
}

/// Five frames and fifty readings.
void fill(auto& file) {
  for (int i = 0; i < 50; ++i) {
    const Time t{1'000'000'000 + 5'000'000 * static_cast<std::int64_t>(i)};
    ASSERT_TRUE(file.add(ImuSample{t, Vec3(0.1 * i, 0, 0), Vec3(0, 9.81, i)}));
    const auto shade = [&](int more) { return std::make_shared<const Image>(80, 60, static_cast<std::uint8_t>(i + more)); };
    if (i % 10 != 5) continue;
    ASSERT_TRUE(file.add(StereoFrame{t, {shade(0), shade(100)}}));
  }
  ASSERT_TRUE(file.finish());
}

void expect_all(const std::string& path, const std::vector<std::string>& topics, const char* left) {
  const Result<CameraRecording> read = open_camera_bag(path, topics);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->cameras.size(), 2u);
  EXPECT_EQ(read->cameras[0], left);
  ASSERT_EQ(read->images.size(), 10u);
  ASSERT_EQ(read->imu.size(), 50u);
  EXPECT_EQ(read->imu[7].accel_mps2.z(), 7);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(read->images[i].camera, static_cast<int>(i % 2));
    EXPECT_EQ(read->images[i].t.ns, 1'025'000'000 + 50'000'000 * static_cast<std::int64_t>(i / 2));
    const Result<Image> image = read->take(i)();
    ASSERT_TRUE(image) << image.error().message;
    const bool right =
        read->cameras[i % 2].find("1") != std::string::npos || read->cameras[i % 2].find("right") != std::string::npos;
    EXPECT_EQ(image->at(3, 4), 5 + 10 * (i / 2) + (right ? 100 : 0));
  }
}

class CameraBags : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_ = fs::temp_directory_path() / ("fbvins_camera_bags_" + std::to_string(::getpid()));
};

TEST_F(CameraBags, ImagesAndReadingsNeedNoCalibration) {
  const std::string path = folder_ / "board.bag";
  auto bag = Ros1BagWriter::create(path, small_rig(), Time{1'000'000'000});
  ASSERT_TRUE(bag);
  fill(*bag);
  EXPECT_TRUE(is_camera_bag(path));
  expect_all(path, {}, "/cam0/image_raw");
  expect_all(path, {"/cam1/image_raw", "/cam0/image_raw"}, "/cam1/image_raw");
  EXPECT_EQ(open_camera_bag(path, {})->imu_noise->gyro_noise_density_radps_rthz, 3e-4);
  EXPECT_EQ(open_camera_bag(path, {"/cam1/image_raw"})->images.size(), 5u);
  EXPECT_NE(open_camera_bag(path, {"/cam2"}).error().message.find("there are images on /cam0/image_raw, /cam1/image_raw"),
            std::string::npos);
}

TEST_F(CameraBags, FlightRecordsAreBags) {
  const std::string path = folder_ / "board.mcap";
  auto record = FlightRecord::create(path, small_rig());
  ASSERT_TRUE(record);
  fill(*record);
  EXPECT_TRUE(is_camera_bag(path));
  expect_all(path, {}, "/camera/left");
}

std::string question(const BagContents& contents, const std::vector<std::string>& named = {}) {
  const Result<ChosenTopics> chosen = choose_cameras(contents, named);
  return chosen ? "none" : chosen.error().message;
}

TEST(CameraTopics, AllCamerasAreFoundOrAskedFor) {
  BagContents contents;
  EXPECT_EQ(question(contents), "holds no images");
  for (const char* topic : {"/a/image_raw", "/a/image_raw/compressed", "/b/image_raw", "/c/left", "/c/right", "/depth/image"})
    contents.images[topic];
  contents.imu["/gyro"], contents.imu["/accel"];
  const auto found = choose_cameras(contents, {});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->cameras, (std::vector<std::string>{"/a/image_raw", "/b/image_raw", "/c/left", "/c/right"}));
  EXPECT_EQ(found->imu, "/gyro");
  EXPECT_EQ(found->accel, "/accel");
  contents.images["/b/image_rect"];
  EXPECT_EQ(
      question(contents),
      "has several image topics of one camera (/a/image_raw, /b/image_raw, /b/image_rect, /c/left, /c/right): say which are the "
      "cameras' with --topics CAM0[,CAM1,...][,IMU][,DEPTH]");
  EXPECT_EQ(question(contents, {"/b/image_raw"}), "none");
  contents.imu["/imu"];
  EXPECT_EQ(question(contents, {"/b/image_raw"}),
            "has 3 IMU topics (/accel, /gyro, /imu): say which it is with --topics CAM0[,CAM1,...][,IMU][,DEPTH]");
  EXPECT_EQ(question(contents, {"/b/image_raw", "/imu"}), "none");
  EXPECT_EQ(question(contents, {"/imu", "/gyro", "/c/left"}), "--topics names two IMUs");
}

TEST(CameraTopics, NineCamerasAreTooMany) {
  BagContents contents;
  for (int k = 0; k < 9; ++k) contents.images["/cam" + std::to_string(k)];
  EXPECT_NE(question(contents).find("has 9 image topics, more than 8"), std::string::npos);
}

}  // namespace camera_bag_test
}  // namespace fbvins
