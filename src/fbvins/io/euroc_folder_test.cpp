// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/euroc_folder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "fbvins/io/dataset.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/png_encode.hpp"

namespace fbvins {
namespace euroc_folder_test {

constexpr int kWidth = 64, kHeight = 48;

StereoRig small_rig() {
  StereoRig rig;
  rig.cameras.resize(2);
  rig.cameras[0].camera = Camera(PinholeRadtan{40, 41, 31.5, 23.5, -0.25, 0.0625, 0.001, -0.002}, kWidth, kHeight);
  rig.cameras[1].camera = Camera(PinholeRadtan{42, 43, 32.5, 22.5, -0.125, 0.03125, 0, 0}, kWidth, kHeight);
  rig.cameras[0].T_BC = {Quat(0.5, -0.5, 0.5, -0.5), Vec3(0.25, 0, 0.125)};
  rig.cameras[1].T_BC = {Quat(0.5, -0.5, 0.5, -0.5), Vec3(0.25, -0.125, 0.125)};
  return rig;
}

std::shared_ptr<const Image> pattern(int shift) {
  auto image = std::make_shared<Image>(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) image->at(x, y) = static_cast<std::uint8_t>(3 * x + 5 * y + shift);
  return image;
}

bool same_pixels(const Image& a, const Image& b) {
  return a.width() == b.width() && a.height() == b.height() && std::equal(a.row(0), a.row(a.height()), b.row(0));
}

std::string empty_folder(const std::string& name) {
  const std::string folder = ::testing::TempDir() + "/fbvins_" + name;
  std::filesystem::remove_all(folder);
  return folder;
}

/// Two frames of four cameras; of the second, `missing` delivers none.
std::string four_cameras(const std::string& name, const StereoRig& rig, int missing) {
  const std::string folder = empty_folder(name);
  auto recording = EurocFolder::create(folder, rig, "made by hand");
  EXPECT_TRUE(recording.ok());
  std::vector<ImuSample> readings;
  for (int i = 0; i < 30; ++i) readings.push_back({Time{1'000'000'000 + i * 5'000'000}, Vec3::Zero(), Vec3(0, 0, 9.81)});
  for (const Time t : {Time{1'020'000'000}, Time{1'070'000'000}}) {
    StereoFrame frame{t, {pattern(0), pattern(1), pattern(2), pattern(3)}};
    if (t.ns > 1'050'000'000) frame.images[static_cast<std::size_t>(missing)] = nullptr;
    EXPECT_TRUE(recording->add(frame, t).ok());
  }
  EXPECT_TRUE(recording->finish(readings, {}).ok());
  return folder;
}

StereoRig four_camera_rig() {
  StereoRig rig = small_rig();
  const Quat back(0.5, 0.5, -0.5, -0.5);
  rig.cameras.insert(rig.cameras.end(), {{rig.right(), {back, Vec3(-0.25, 0.125, 0)}}, {rig.left(), {back, Vec3(-0.25, 0, 0)}}});
  return rig;
}

TEST(EurocFolder, KeepsFourCameras) {
  const StereoRig rig = four_camera_rig();
  const auto data = open_dataset(four_cameras("euroc_four", rig, 3));
  ASSERT_TRUE(data) << data.error().message;
  ASSERT_EQ((*data)->rig().camera_count(), 4);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ((*data)->rig().camera(i).intrinsics(), rig.camera(i).intrinsics());
    EXPECT_TRUE((*data)->rig().T_BC(i).p.isApprox(rig.T_BC(i).p, 1e-12));
  }
  std::vector<StereoFrame> frames;
  while (auto event = (*data)->next())
    if (auto* frame = std::get_if<StereoFrame>(&*event)) frames.push_back(std::move(*frame));
  ASSERT_EQ(frames.size(), 2u);
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(same_pixels(*frames[0].image(i), *pattern(i))) << "camera " << i;
  EXPECT_TRUE(frames[1].image(2));
  EXPECT_FALSE(frames[1].image(3));
}

TEST(EurocFolder, ACameraWhoseImagesStayAwayIsNamed) {
  const std::string folder = empty_folder("euroc_silent");
  auto recording = EurocFolder::create(folder, four_camera_rig(), "made by hand");
  ASSERT_TRUE(recording.ok());
  for (int i = 0; i < 40; ++i) {
    const Time t{1'000'000'000 + i * 50'000'000LL};
    StereoFrame frame{t, {i < 15 ? pattern(0) : nullptr, pattern(1), pattern(2), i % 4 == 0 ? pattern(3) : nullptr}};
    ASSERT_TRUE(recording->add(frame, t).ok());
  }
  std::vector<ImuSample> readings;
  for (int i = 0; i < 400; ++i) readings.push_back({Time{1'000'000'000 + i * 5'000'000LL}, Vec3::Zero(), Vec3(0, 0, 9.81)});
  ASSERT_TRUE(recording->finish(readings, {}).ok());
  const auto named = [&](const char* camera) {
    DatasetOptions options;
    options.camera = camera;
    const std::vector<std::string> warnings = (*open_dataset(folder, options))->info().warnings;
    return std::ranges::count(warnings, "camera 0: no images for 1.2 s, from 0.7 s after the first frame on");
  };
  EXPECT_EQ(named("all"), 1);
  EXPECT_EQ(named("both"), 1);
  EXPECT_EQ(named("right"), 0);
}

TEST(EurocFolder, AnyOfTheCamerasIsARecordingAndANewNumberIsSaid) {
  const StereoRig rig = four_camera_rig();
  const std::string folder = four_cameras("euroc_any", rig, 3);
  std::filesystem::remove_all(folder + "/mav0/cam1");
  const auto three = open_dataset(folder);
  ASSERT_TRUE(three) << three.error().message;
  EXPECT_EQ((*three)->rig().camera_count(), 3);
  EXPECT_EQ((*three)->info().warnings.at(0), "cameras are numbered as they come, cam2 is camera 1, cam3 is camera 2");
  std::filesystem::remove_all(folder + "/mav0/cam0");
  std::filesystem::remove_all(folder + "/mav0/cam3");
  const auto one = open_dataset(folder);
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_EQ((*one)->rig().camera_count(), 1);
  EXPECT_TRUE((*one)->rig().T_BC0().p.isApprox(rig.T_BC(2).p, 1e-12));
}

TEST(EurocFolder, OfFourCamerasTheFirstTwoCanBeUsed) {
  DatasetOptions options;
  options.camera = "both";
  const auto data = open_dataset(four_cameras("euroc_both_of_four", four_camera_rig(), 3), options);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ((*data)->rig().camera_count(), 2);
  while (auto event = (*data)->next())
    if (auto* frame = std::get_if<StereoFrame>(&*event)) {
      EXPECT_EQ(frame->images.size(), 2u);
    }
}

std::shared_ptr<const DepthImage> depths(int shift, const Camera& camera = small_rig().left()) {
  auto depth = std::make_shared<DepthImage>(DepthImage{camera.width(), camera.height(), {}});
  for (int i = 0; i < camera.width() * camera.height(); ++i)
    depth->mm.push_back(static_cast<std::uint16_t>(1000 + 7 * i + shift));
  return depth;
}

/// Two frames of one camera and a depth sensor; the second has no depth image.
std::string depth_recording(const std::string& name, const std::optional<MountedCamera>& own = {}) {
  const std::string folder = empty_folder(name);
  const StereoRig rig = with_depth(small_rig(), {.noise_at_1m_m = 0.0025, .nearest_m = 0.25, .farthest_m = 5.5, .own = own});
  auto recording = EurocFolder::create(folder, rig, "made by hand");
  EXPECT_TRUE(recording.ok());
  std::vector<ImuSample> readings;
  for (int i = 0; i < 30; ++i) readings.push_back({Time{1'000'000'000 + i * 5'000'000}, Vec3::Zero(), Vec3(0, 0, 9.81)});
  EXPECT_TRUE(recording->add({Time{1'020'000'000}, {pattern(0)}, depths(0, rig.depth_camera())}, Time{}).ok());
  EXPECT_TRUE(recording->add({Time{1'070'000'000}, {pattern(1)}}, Time{}).ok());
  EXPECT_TRUE(recording->finish(readings, {}).ok());
  return folder;
}

std::vector<StereoFrame> frames_of(Dataset& data) {
  std::vector<StereoFrame> frames;
  while (auto event = data.next())
    if (auto* frame = std::get_if<StereoFrame>(&*event)) frames.push_back(std::move(*frame));
  return frames;
}

TEST(EurocFolder, KeepsDepthImages) {
  const auto data = open_dataset(depth_recording("euroc_depth"));
  ASSERT_TRUE(data) << data.error().message;
  const StereoRig& rig = (*data)->rig();
  ASSERT_TRUE(rig.depth);
  EXPECT_EQ(rig.camera_count(), 1);
  EXPECT_EQ(rig.depth->noise_at_1m_m, 0.0025);
  EXPECT_EQ(rig.depth->nearest_m, 0.25);
  EXPECT_EQ(rig.depth->farthest_m, 5.5);
  const std::vector<StereoFrame> frames = frames_of(**data);
  ASSERT_EQ(frames.size(), 2u);
  ASSERT_TRUE(frames[0].depth);
  EXPECT_EQ(frames[0].depth->mm, depths(0)->mm);
  EXPECT_FALSE(frames[1].depth);
  EXPECT_TRUE(frames[1].left());
}

TEST(EurocFolder, KeepsTheLensAndThePoseOfADepthSensorThatLiesElsewhere) {
  const MountedCamera own{Camera(PinholeRadtan{30, 31, 20.5, 14.5, -0.125, 0.0625, 0, 0}, 40, 30),
                          {Quat(0.5, -0.5, 0.5, 0.5), Vec3(0.25, -0.0625, 0.125)}};
  const std::string folder = depth_recording("euroc_depth_elsewhere", own);
  const auto data = open_dataset(folder);
  ASSERT_TRUE(data) << data.error().message;
  const DepthSensor& sensor = *(*data)->rig().depth;
  ASSERT_TRUE(sensor.own);
  EXPECT_EQ(sensor.own->camera.intrinsics(), own.camera.intrinsics());
  EXPECT_EQ(sensor.own->camera.distortion(), own.camera.distortion());
  EXPECT_EQ(sensor.own->camera.width(), 40);
  EXPECT_TRUE(sensor.own->T_BC.p.isApprox(own.T_BC.p, 1e-12));
  EXPECT_LT(sensor.own->T_BC.q.angularDistance(own.T_BC.q), 1e-12);
  EXPECT_EQ(sensor.farthest_m, 5.5);
  EXPECT_EQ(frames_of(**data)[0].depth->mm, depths(0, own.camera)->mm);
  // A lens without its pose is a mistake, and so is an image of the camera's size.
  const std::string yaml = folder + "/mav0/depth0/sensor.yaml";
  const std::string whole = *read_file(yaml, 1u << 16u), without = whole.substr(whole.find("resolution"));
  std::ofstream(yaml) << without;
  const auto placeless = open_dataset(folder);
  ASSERT_FALSE(placeless);
  EXPECT_NE(placeless.error().message.find("T_BS"), std::string::npos) << placeless.error().message;
  std::ofstream(yaml) << "noise_at_1m_m: 0.0025\n";
  const auto registered = open_dataset(folder);
  ASSERT_FALSE(registered);
  EXPECT_NE(registered.error().message.find("40 x 30"), std::string::npos) << registered.error().message;
}

TEST(EurocFolder, OfADepthRecordingTheCameraAloneCanBeUsed) {
  DatasetOptions options;
  options.camera = "left";
  const auto data = open_dataset(depth_recording("euroc_no_depth"), options);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_FALSE((*data)->rig().depth);
  for (const StereoFrame& frame : frames_of(**data)) EXPECT_FALSE(frame.depth);
}

TEST(EurocFolder, ADepthImageThatCannotBeReadIsCounted) {
  const std::string folder = depth_recording("euroc_bad_depth");
  std::ofstream(folder + "/mav0/depth0/data/1020000000.png") << "not a PNG";
  const auto none = open_dataset(folder);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("none of 1 depth images"), std::string::npos) << none.error().message;
  std::filesystem::remove(folder + "/mav0/depth0/data/1020000000.png");
  const auto missing = open_dataset(folder);
  ASSERT_TRUE(missing) << missing.error().message;
  EXPECT_EQ((*missing)->info().depth.images.missing, 1);
}

TEST(EurocFolder, WhereTwoCamerasSeeDepthsDepthImagesAreUsedWhenAskedFor) {
  const std::string folder = four_cameras("euroc_depth_asked", four_camera_rig(), 3);
  DatasetOptions options;
  options.camera = "depth";
  const auto none = open_dataset(folder, options);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("there are no depth images"), std::string::npos) << none.error().message;
  std::filesystem::copy(depth_recording("euroc_depth_source") + "/mav0/depth0", folder + "/mav0/depth0",
                        std::filesystem::copy_options::recursive);
  const auto all = open_dataset(folder);
  ASSERT_TRUE(all) << all.error().message;
  EXPECT_FALSE((*all)->rig().depth);
  EXPECT_EQ((*all)->rig().camera_count(), 4);
  const auto depth = open_dataset(folder, options);
  ASSERT_TRUE(depth) << depth.error().message;
  EXPECT_TRUE((*depth)->rig().depth);
  EXPECT_EQ((*depth)->rig().camera_count(), 1);
  const std::vector<StereoFrame> frames = frames_of(**depth);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_TRUE(frames[0].depth);
  EXPECT_FALSE(frames[0].right());
}

TEST(EurocFolder, KeepsTimeOffsetAndRange) {
  const std::string folder = empty_folder("euroc_offset");
  StereoRig rig = small_rig();
  rig.time_offset_s = -0.0075;
  rig.line_delay_s = 41.5e-6;
  rig.cameras[1].camera.set_own_times({.time_offset_s = 0.0075, .line_delay_s = -41.5e-6});
  rig.imu_noise.max_gyro_radps = 8.5;
  auto recording = EurocFolder::create(folder, rig, "made by hand");
  ASSERT_TRUE(recording) << recording.error().message;
  std::vector<ImuSample> readings;
  for (int i = 0; i < 30; ++i) readings.push_back({Time{1'000'000'000 + i * 5'000'000}, Vec3::Zero(), Vec3(0, 0, 9.81)});
  for (const Time t : {Time{1'020'000'000}, Time{1'070'000'000}})
    ASSERT_TRUE(recording->add({t, {pattern(0), pattern(1)}}, t - Duration{7'500'000}));
  const std::vector<TrajectoryPoint> truth = {{Time{1'020'000'000}, {}, std::nullopt, std::nullopt}};
  ASSERT_TRUE(recording->finish(readings, truth));
  const auto data = open_dataset(folder);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ((*data)->rig().time_offset_s, -0.0075);
  EXPECT_DOUBLE_EQ((*data)->rig().line_delay_s, 41.5e-6);
  EXPECT_EQ((*data)->rig().times(1), CameraTimes{}) << "a camera on time, with a global shutter";
  EXPECT_EQ((*data)->rig().imu_noise.max_gyro_radps, 8.5);
  ASSERT_EQ((*data)->ground_truth().size(), 1u);
  EXPECT_FALSE((*data)->ground_truth()[0].v_WB) << "a truth of poses alone has no velocity, also not one of zero";
}

TEST(EurocFolder, ReadsBackWithImagesReadingsAndTruth) {
  const std::string folder = empty_folder("euroc_folder");
  std::vector<ImuSample> readings;
  std::vector<TrajectoryPoint> truth;
  for (int i = 0; i <= 40; ++i) {
    const Time t{1'000'000'000 + i * 5'000'000};
    readings.push_back({t, Vec3(0.01 * i, -0.125, 1.0 / 3), Vec3(0.1, 0.2, 9.81 + 0.01 * i)});
    truth.push_back({t, {Quat::Identity(), Vec3(0.5 * i, 0, 1)}, std::nullopt, std::nullopt});
  }
  {
    auto recording = EurocFolder::create(folder, small_rig(), "made by hand");
    ASSERT_TRUE(recording) << recording.error().message;
    for (int i = 0; i < 3; ++i) {
      const Time t{1'050'000'000 + i * 50'000'000};
      ASSERT_TRUE(recording->add({t, {pattern(i), i == 1 ? nullptr : pattern(100 + i)}}, t));
    }
    const Result<void> done = recording->finish(readings, truth);
    ASSERT_TRUE(done) << done.error().message;
  }
  auto data = open_dataset(folder);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ((*data)->rig().T_BC1().p, small_rig().T_BC1().p);
  EXPECT_NEAR((*data)->rig().left().focal_px(), small_rig().left().focal_px(), 1e-12);
  int samples = 0, frames = 0;
  while (auto event = (*data)->next()) {
    if (const auto* reading = std::get_if<ImuSample>(&*event)) {
      EXPECT_EQ(reading->gyro_radps, readings[samples].gyro_radps);
      EXPECT_EQ(reading->accel_mps2, readings[samples++].accel_mps2);
      continue;
    }
    const auto& frame = std::get<StereoFrame>(*event);
    EXPECT_TRUE(frame.left() && same_pixels(*frame.left(), *pattern(frames)));
    if (frames == 1) EXPECT_EQ(frame.right(), nullptr);
    else EXPECT_TRUE(frame.right() && same_pixels(*frame.right(), *pattern(100 + frames)));
    ++frames;
  }
  EXPECT_EQ(samples, 41);
  EXPECT_EQ(frames, 3);
  ASSERT_EQ((*data)->ground_truth().size(), truth.size());
  EXPECT_EQ((*data)->ground_truth()[7].T_WB.p, truth[7].T_WB.p);
  for (const char* sensor : {"cam0", "cam1", "imu0"}) {
    std::stringstream text;
    text << std::ifstream(folder + "/mav0/" + sensor + "/sensor.yaml").rdbuf();
    EXPECT_NE(text.str().find("comment: made by hand\n"), std::string::npos) << sensor;
  }
  std::filesystem::remove_all(folder);
}

TEST(EurocFolder, KeepsMasksAndReadsAPicture) {
  StereoRig rig = four_camera_rig();
  Image seen(kWidth, kHeight, 255);
  hide(seen, MaskCircle{30, 40, 9});
  rig.cameras[0].camera.set_mask(std::make_shared<const Mask>(seen));
  const std::string folder = four_cameras("euroc_masks", rig, 3);
  const std::string picture = encode_png(rig.left().mask()->image());
  std::ofstream(folder + "/mav0/cam3/legs.png", std::ios::binary).write(picture.data(), std::ssize(picture));
  std::ofstream(folder + "/mav0/cam3/sensor.yaml", std::ios::app) << "mask: legs.png\n";
  const auto data = open_dataset(folder);
  ASSERT_TRUE(data) << data.error().message;
  for (const int camera : {0, 3}) {
    ASSERT_TRUE((*data)->rig().camera(camera).mask()) << camera;
    EXPECT_EQ((*data)->rig().camera(camera).mask()->rectangles(), rig.left().mask()->rectangles());
  }
  EXPECT_EQ((*data)->rig().camera(1).mask(), nullptr);
  std::filesystem::remove(folder + "/mav0/cam3/legs.png");
  const auto without = open_dataset(folder);
  ASSERT_FALSE(without);
  EXPECT_NE(without.error().message.find("cam3/sensor.yaml:"), std::string::npos) << without.error().message;
  EXPECT_NE(without.error().message.find("mask: "), std::string::npos);
  EXPECT_NE(without.error().message.find("legs.png: no such file"), std::string::npos) << without.error().message;
}

TEST(EurocFolder, NeverOverwritesARecording) {
  const std::string folder = empty_folder("euroc_folder_twice");
  ASSERT_TRUE(EurocFolder::create(folder, small_rig(), "first"));
  const auto again = EurocFolder::create(folder, small_rig(), "second");
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::unwritable);
  EXPECT_NE(again.error().message.find("exists already"), std::string::npos);
  std::filesystem::remove_all(folder);
}

}  // namespace euroc_folder_test
}  // namespace fbvins
