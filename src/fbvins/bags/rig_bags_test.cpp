// SPDX-License-Identifier: Apache-2.0
// Bags of rigs other than one pair: of one camera, of more than two, with a depth sensor.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <memory>

#include "fbvins/bags/depth_image.hpp"
#include "fbvins/bags/recording.hpp"
#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/bags/topic_choice.hpp"
#include "fbvins/io/ros_messages.hpp"

namespace fbvins {
namespace rig_bags_test {

namespace fs = std::filesystem;

constexpr int kWidth = 80, kHeight = 60;

StereoRig rig_of_cameras(int count) {
  std::vector<MountedCamera> cameras;
  for (int i = 0; i < count; ++i)
    cameras.push_back({Camera(PinholeRadtan{90.0 + i, 91, 40, 30, 0.1, 0.2, 0.01, 0.02}, kWidth, kHeight),
                       {so3_exp({0.1, 0.2 * i, 1.5}), {0.01, 0.1 * i, 0.03}}});
  StereoRig rig = with_cameras({}, cameras);
  rig.imu_noise.gyro_noise_density_radps_rthz = 3e-4;
  return rig;
}

Time at(int i) { return Time{1'000'000'000 + 50'000'000 * static_cast<std::int64_t>(i)}; }

std::shared_ptr<const Image> shade(int grey) {
  return std::make_shared<const Image>(kWidth, kHeight, static_cast<std::uint8_t>(grey));
}

class RigBags : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path() const { return folder_ / "flight.bag"; }

  /// Ten frames; camera 2 has none in the fourth, and takes its images 1 ms later.
  void write(const StereoRig& rig) {
    auto bag = Ros1BagWriter::create(path(), rig, at(0));
    ASSERT_TRUE(bag) << bag.error().message;
    for (int i = 0; i < 10; ++i) {
      ASSERT_TRUE(bag->add(ImuSample{at(i), Vec3::Zero(), Vec3(0, 0, 9.81)}));
      StereoFrame frame{at(i), {shade(i), rig.has_right() ? shade(i + 20) : nullptr}};
      for (int k = 2; k < rig.camera_count(); ++k) frame.set_image(k, i == 4 && k == 2 ? nullptr : shade(i + 20 * k));
      frame.offsets.set(2, Duration{1'000'000});
      if (rig.depth) {
        const Camera& seen_by = rig.depth_camera();
        auto depth = std::make_shared<DepthImage>(DepthImage{seen_by.width(), seen_by.height(), {}});
        depth->mm.assign(static_cast<std::size_t>(depth->width) * static_cast<std::size_t>(depth->height),
                         static_cast<std::uint16_t>(2000 + i));
        frame.depth = std::move(depth);
      }
      ASSERT_TRUE(bag->add(frame));
    }
    ASSERT_TRUE(bag->finish());
  }
  std::unique_ptr<Dataset> open(const RecordingOptions& options = {}) {
    auto data = open_recording(path(), options);
    EXPECT_TRUE(data) << data.error().message;
    return data ? *std::move(data) : nullptr;
  }
  std::vector<StereoFrame> frames(Dataset& data) {
    std::vector<StereoFrame> out;
    while (auto event = data.next())
      if (auto* frame = std::get_if<StereoFrame>(&*event)) out.push_back(std::move(*frame));
    return out;
  }
  fs::path folder_ = fs::temp_directory_path() / ("fbvins_rig_bags_" + std::to_string(::getpid()));
};

TEST_F(RigBags, FourCamerasAreReadAsWritten) {
  write(rig_of_cameras(4));
  const auto data = open();
  ASSERT_TRUE(data);
  ASSERT_EQ(data->rig().camera_count(), 4);
  EXPECT_EQ(data->rig().camera(3).intrinsics()[0], 93);
  EXPECT_EQ(data->rig().T_BC(3).p.y(), 0.1 * 3);
  EXPECT_EQ(data->rig().imu_noise.gyro_noise_density_radps_rthz, 3e-4);
  const std::vector<StereoFrame> read = frames(*data);
  ASSERT_EQ(read.size(), 10u);
  for (int i = 0; i < 10; ++i) {
    const StereoFrame& frame = read[static_cast<std::size_t>(i)];
    for (int k = 0; k < 4; ++k) {
      ASSERT_EQ(frame.image(k) == nullptr, i == 4 && k == 2) << i << " " << k;
      if (frame.image(k)) {
        EXPECT_EQ(frame.image(k)->at(5, 6), i + 20 * k);
      }
    }
  }
  EXPECT_EQ(data->info().further().listed, 19);
}

TEST_F(RigBags, SomeOfTheCamerasMayBeChosen) {
  write(rig_of_cameras(4));
  EXPECT_EQ(open({.dataset = {.camera = "both"}})->rig().camera_count(), 2);
  EXPECT_EQ(open({.topics = {"/cam0/image_raw", "/cam1/image_raw", "/cam2/image_raw"}})->rig().camera_count(), 3);
  // Not the calibration on /fbvins/calibration, but that of camera_info and /tf_static.
  const auto last = open({.topics = {"/cam3/image_raw", "/imu0"}});
  ASSERT_TRUE(last);
  EXPECT_EQ(last->rig().camera_count(), 1);
  EXPECT_EQ(last->rig().left().intrinsics()[0], 93);
  EXPECT_EQ(frames(*last)[7].left()->at(5, 6), 67);
  EXPECT_NE(open_recording(path(), {.dataset = {.rig = rig_of_cameras(2)},
                                    .topics = {"/cam0/image_raw", "/cam1/image_raw", "/cam3/image_raw"}})
                .error()
                .message.find("images of 3 cameras are to be used, and the calibration has 2"),
            std::string::npos);
  EXPECT_EQ(open({.dataset = {.rig = rig_of_cameras(2)}})->rig().camera_count(), 2);
}

TEST_F(RigBags, OneCameraIsARecording) {
  write(rig_of_cameras(1));
  const auto data = open();
  ASSERT_TRUE(data);
  EXPECT_FALSE(data->rig().has_right());
  EXPECT_EQ(frames(*data).size(), 10u);
  ASSERT_EQ(data->info().warnings.size(), 1u);
  EXPECT_EQ(data->info().warnings.front().find("IMU: 20 readings a second"), 0u) << data->info().warnings.front();
}

TEST_F(RigBags, TwoImagesSideBySideAreThoseOfTwoCameras) {
  StereoRig wide = rig_of_cameras(1);
  const StereoRig two = rig_of_cameras(2);
  const int width = two.left().width(), height = two.left().height();
  wide.cameras[0].camera = Camera(PinholeRadtan{90, 91, 40, 30, 0, 0, 0, 0}, 2 * width, height);
  auto bag = Ros1BagWriter::create(path(), wide, Time{1'000'000'000});
  ASSERT_TRUE(bag) << bag.error().message;
  for (std::int64_t i = 0; i < 60; ++i) {
    const Time t{1'000'000'000 + 5'000'000 * i};
    ASSERT_TRUE(bag->add(ImuSample{t, Vec3::Zero(), Vec3(0, 0, 9.81)}));
    if (i % 10 != 5) continue;
    auto both = std::make_shared<Image>(2 * width, height, std::uint8_t{10});
    for (int y = 0; y < height; ++y)
      for (int x = width; x < 2 * width; ++x) both->at(x, y) = 200;
    ASSERT_TRUE(bag->add(StereoFrame{t, {both}}));
  }
  ASSERT_TRUE(bag->finish());
  const auto data = open({.dataset = {.rig = two}});
  ASSERT_TRUE(data);
  EXPECT_TRUE(data->rig().has_right());
  const auto said = [](const std::string& w) { return w.find("are two side by side") != w.npos; };
  EXPECT_EQ(std::ranges::count_if(data->info().warnings, said), 1);
  int frames = 0;
  while (auto event = data->next()) {
    const auto* frame = std::get_if<StereoFrame>(&*event);
    if (!frame) continue;
    ++frames;
    ASSERT_TRUE(frame->left() && frame->right());
    EXPECT_EQ(frame->left()->width(), width);
    EXPECT_EQ(frame->left()->at(width - 1, 3), 10);
    EXPECT_EQ(frame->right()->at(0, 3), 200);
  }
  EXPECT_EQ(frames, 6);
}

TEST_F(RigBags, DepthImagesAreOfTheCamera) {
  write(with_depth(rig_of_cameras(1), {.noise_at_1m_m = 0.007}));
  const auto data = open();
  ASSERT_TRUE(data);
  ASSERT_TRUE(data->rig().depth);
  EXPECT_EQ(data->rig().depth->noise_at_1m_m, 0.007);
  const std::vector<StereoFrame> read = frames(*data);
  ASSERT_EQ(read.size(), 10u);
  ASSERT_TRUE(read[6].depth);
  EXPECT_EQ(read[6].depth->row(59)[79], 2006);
  EXPECT_FALSE(open({.dataset = {.camera = "left"}})->rig().depth);
}

/// By the whole calibration in the bag, and by camera_info and /tf_static where other topics than its own are asked for.
TEST_F(RigBags, ADepthSensorThatLiesElsewhereHasItsOwnLensAndPose) {
  const StereoRig one = rig_of_cameras(1);
  const MountedCamera own{Camera(PinholeRadtan{50, 51, 20, 16, 0.1, 0, 0, 0}, 40, 32),
                          one.T_BC0() * Pose<C0, C0>(so3_exp({0.01, 0.02, 0.03}), Vec3(0.015, 0.002, 0.001))};
  write(with_depth(one, {.noise_at_1m_m = 0.007, .own = own}));
  const auto expect_own = [&](const Dataset& data, double tolerance) {
    ASSERT_TRUE(data.rig().depth && data.rig().depth->own);
    const MountedCamera& read = *data.rig().depth->own;
    EXPECT_EQ(read.camera.width(), 40);
    EXPECT_EQ(read.camera.intrinsics(), own.camera.intrinsics());
    EXPECT_LE((read.T_BC.p - own.T_BC.p).norm(), tolerance);
    EXPECT_LE((read.T_BC.R() - own.T_BC.R()).norm(), tolerance);
  };
  const auto data = open();
  ASSERT_TRUE(data);
  expect_own(*data, 0);
  const std::vector<StereoFrame> read = frames(*data);
  ASSERT_TRUE(read[6].depth);
  EXPECT_EQ(read[6].depth->row(31)[39], 2006);
  const StereoRig calibrated = one;  // of the camera alone: that of the depth sensor is the bag's
  const auto by_transforms = open({.dataset = {.rig = calibrated}});
  ASSERT_TRUE(by_transforms);
  expect_own(*by_transforms, 1e-12);
  EXPECT_EQ(by_transforms->rig().depth->noise_at_1m_m, DepthSensor{}.noise_at_1m_m);
}

TEST_F(RigBags, WithoutDepthImagesTheyCannotBeAskedFor) {
  write(rig_of_cameras(2));
  EXPECT_NE(open_recording(path(), {.dataset = {.camera = "depth"}}).error().message.find("there are no depth images"),
            std::string::npos);
}

TEST(RigTopics, NumberedCamerasFollowTheFirstTwo) {
  BagContents contents;
  contents.imu["/imu"];
  for (const char* topic : {"/cam0/image", "/cam1/image", "/cam2/image", "/cam3/image", "/cam5/image", "/colour"})
    contents.images[topic];
  EXPECT_EQ(choose_topics(contents, {}, {})->cameras,
            (std::vector<std::string>{"/cam0/image", "/cam1/image", "/cam2/image", "/cam3/image"}));
  EXPECT_EQ(choose_topics(contents, {}, {.most_cameras = 3})->cameras.size(), 3u);
  EXPECT_EQ(choose_topics(contents, {"/imu", "/cam5/image", "/colour"}, {})->cameras,
            (std::vector<std::string>{"/cam5/image", "/colour"}));
}

TEST(RigTopics, CamerasThatNobodyHasCalibratedAreLeftOut) {
  BagContents contents;
  contents.imu["/imu"].frame = "imu";
  for (const std::string number : {"0", "1", "2", "3"}) {
    contents.images["/cam" + number + "/image"];
    if (number == "2") continue;
    contents.cameras["/cam" + number + "/camera_info"] = {rig_of_cameras(1).left(), "frame" + number};
    contents.transforms.push_back({"imu", "frame" + number, Quat::Identity(), Vec3(0, 0.1 * (number[0] - '0'), 0)});
  }
  auto topics = choose_topics(contents, {}, {});
  ASSERT_TRUE(topics);
  topics->cameras = calibrated_cameras(contents, *topics);
  EXPECT_EQ(topics->cameras, (std::vector<std::string>{"/cam0/image", "/cam1/image", "/cam3/image"}));
  const auto rig = rig_of(contents, *topics);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->T_BC(2).p.y(), 0.1 * 3);
  contents.transforms = {{"/imu", "/frame0", Quat::Identity(), Vec3(0, 0, 0)},
                         {"imu", "frame1", Quat::Identity(), Vec3(0, 0.1, 0)},
                         {"imu", "elsewhere", Quat::Identity(), Vec3(0, 0, 0)}};
  EXPECT_EQ(
      rig_of(contents, *topics).error().message,
      "holds no calibration (no transform from 'frame3' to 'imu'; there are transforms between /frame0, /imu, elsewhere, frame1, "
      "imu): give one with --calibration");
  contents.transforms.clear();
  EXPECT_EQ(rig_of(contents, *topics).error().message,
            "holds no calibration (no transform from 'frame0' to 'imu'): give one with --calibration");
  EXPECT_EQ(rig_of(contents, *topics, "l.yaml,r.yaml").error().message,
            "l.yaml,r.yaml has no place of the cameras on the IMU, nor has the bag (no transform from 'frame0' to 'imu'): record "
            "/tf_static, or give the lenses as Kalibr's chain with T_cam_imu");
}

TEST(RigTopics, RectifiedImagesAreThoseOfRAndP) {
  EXPECT_TRUE(names_rectified("/stereo/left/image_rect") && names_rectified("/left/image_rect_color") &&
              names_rectified("/left/rect/image") && names_rectified("/cam0/rectified"));
  EXPECT_FALSE(names_rectified("/direct/image_raw") || names_rectified("/left/image_raw") || names_rectified("/left/correct"));
  BagContents contents;
  contents.imu["/imu"].frame = "imu";
  const Mat3 R = so3_exp({0.01, -0.02, 0.03}).toRotationMatrix();
  const Camera straight(PinholeRadtan{80, 80, 41, 31}, kWidth, kHeight);
  for (const std::string side : {"left", "right"}) {
    contents.images["/" + side + "/image_rect"], contents.images["/" + side + "/image_raw"];
    contents.cameras["/" + side + "/camera_info"] = {rig_of_cameras(1).left(), side, BagCamera::Rectified{straight, R, 0.1}};
    contents.transforms.push_back({"imu", side, Quat::Identity(), Vec3(0, side == "left" ? 0 : 0.2, 0)});
  }
  const ChosenTopics rectified{{"/left/image_rect", "/right/image_rect"}, "/imu", "", ""},
      raw{{"/left/image_raw", "/right/image_raw"}, "/imu", "", ""};
  EXPECT_EQ(rig_of(contents, raw)->left().intrinsics()[0], 90);
  EXPECT_TRUE(rectified_topics(contents, raw).empty());
  EXPECT_EQ(rectified_topics(contents, rectified), rectified.cameras);
  EXPECT_EQ(rectifiable_topics(contents, raw), raw.cameras);
  auto rig = rig_of(contents, rectified);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->left().intrinsics()[0], 80);
  EXPECT_LT((rig->T_BC0().R() - R.transpose()).norm(), 1e-12);
  EXPECT_LT((rig->T_BC1().p - Vec3(0, 0.2, 0)).norm(), 1e-12) << "where its own frame is";
  contents.cameras["/right/camera_info"].frame = "left";
  rig = rig_of(contents, rectified);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_LT((rig->T_BC1().p - R.transpose() * Vec3(0.1, 0, 0)).norm(), 1e-12) << "in the first one's rectified axes";
}

TEST(RigTopics, ABinnedAndCutImageHasItsOwnLens) {
  std::string info;
  append_camera_info(info, at(0), "frame", Camera(PinholeRadtan{400, 410, 321, 239, 0.1, 0, 0, 0}, 640, 480));
  const auto set = [&](std::size_t field, std::uint32_t value) {  // binning_x, binning_y, x, y, height, width; then do_rectify
    std::memcpy(info.data() + info.size() - 25 + 4 * field, &value, 4);
  };
  const auto lens = [&] { return camera_of(info, Encoding::cdr)->camera; };
  EXPECT_EQ(lens().width(), 640);
  set(0, 2), set(1, 2);
  EXPECT_EQ(lens().width(), 320);
  EXPECT_EQ(lens().intrinsics(), (std::array{200.0, 205.0, 160.25, 119.25}));
  set(2, 100), set(3, 40), set(4, 400), set(5, 400);
  EXPECT_EQ(lens().height(), 200);
  EXPECT_EQ(lens().intrinsics(), (std::array{200.0, 205.0, 110.25, 99.25}));
  set(2, 900);
  EXPECT_EQ(lens().width(), 640) << "a region outside of the image is none";
}

TEST(RigTopics, DepthImagesAreNoCameras) {
  EXPECT_TRUE(names_depth("/camera/aligned_depth_to_color/image_raw") && names_depth("/Depth_0") &&
              names_depth("/tof/compressedDepth"));
  EXPECT_FALSE(names_depth("/depthai/left/image_raw") || names_depth("/left"));
  BagContents contents;
  contents.imu["/imu"].frame = "imu";
  contents.images["/colour/image"], contents.images["/depth/image"], contents.images["/depth/image/compressedDepth"];
  const auto one = choose_topics(contents, {}, {.depth = true});
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_EQ(one->cameras, std::vector<std::string>{"/colour/image"});
  EXPECT_EQ(one->depth, "/depth/image");
  EXPECT_EQ(choose_topics(contents, {}, {})->depth, "");
  contents.images["/aligned_depth/image"];
  EXPECT_EQ(
      choose_topics(contents, {}, {.depth = true}).error().message,
      "has 2 topics of depth images (/aligned_depth/image, /depth/image): say which are registered to the camera with --topics "
      "CAM0[,CAM1,...][,IMU][,DEPTH]");
  EXPECT_EQ(choose_topics(contents, {"/aligned_depth/image"}, {.depth = true})->depth, "/aligned_depth/image");
}

TEST(RigTopics, DepthImagesOfAnotherCameraAreNotRegistered) {
  BagContents contents;
  contents.cameras["/colour/camera_info"] = {rig_of_cameras(1).left(), "colour"};
  contents.cameras["/depth/camera_info"] = {rig_of_cameras(1).left(), "colour"};
  const ChosenTopics topics{{"/colour/image"}, "", "", "/depth/image"};
  EXPECT_EQ(not_registered(contents, topics), "");
  contents.cameras["/depth/camera_info"].frame = "infra";
  contents.transforms.push_back({"colour", "infra", Quat::Identity(), Vec3(0.015, 0, 0)});
  EXPECT_EQ(not_registered(contents, topics), "they are in the frame 'infra', 15.0 mm from the camera's");
  contents.cameras["/depth/camera_info"].camera = Camera(PinholeRadtan{70, 70, 40, 30}, kWidth, kHeight);
  EXPECT_NE(not_registered(contents, topics).find("80 x 60 pixels and 70.0 px of focal length"), std::string::npos);
  const auto own = depth_camera_of(contents, topics, rig_of_cameras(1));
  ASSERT_TRUE(own);
  EXPECT_EQ(own->camera.focal_px(), 70);
  EXPECT_LT((own->T_BC.p - rig_of_cameras(1).T_BC0() * Vec3(0.015, 0, 0)).norm(), 1e-12);
  contents.transforms.clear();
  EXPECT_FALSE(depth_camera_of(contents, topics, rig_of_cameras(1))) << "nobody says where it is";
}

TEST(DepthImages, MillimetresAndMetresAreRead) {
  const std::uint16_t mm[] = {0, 1500, 65535, 7};
  const auto whole = depth_image({2, 2, 4, "16UC1", false, {reinterpret_cast<const char*>(mm), sizeof(mm)}});
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ(whole->mm, (std::vector<std::uint16_t>{0, 1500, 65535, 7}));
  const float m[] = {1.5F, std::nanf(""), -1, 0.0004F, 70, 2.0005F};
  const auto floats = depth_image({2, 2, 12, "32FC1", false, {reinterpret_cast<const char*>(m), sizeof(m)}});
  ASSERT_TRUE(floats) << floats.error().message;
  EXPECT_EQ(floats->mm, (std::vector<std::uint16_t>{1500, 0, 0, 0})) << "rows of 12 bytes: 1.5, nan | 0.0004, 70";
  const auto big = depth_image({1, 1, 2, "mono16", true, std::string_view("\x05\xdc", 2)});
  ASSERT_TRUE(big);
  EXPECT_EQ(big->mm.front(), 1500);
  EXPECT_EQ(depth_image({1, 1, 3, "rgb8", false, "abc"}).error().message,
            "depth images encoded as 'rgb8' cannot be read, only 16UC1 and 32FC1");
  EXPECT_FALSE(depth_image({2, 2, 4, "16UC1", false, "abcdefg"}));
}

}  // namespace rig_bags_test
}  // namespace fbvins
