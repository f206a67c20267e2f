// SPDX-License-Identifier: Apache-2.0
// Cameras that are simulated here, in wall time.
#include "fbvins/v4l2/v4l2_source.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/collected_input.hpp"
#include "tests/support/running_source.hpp"

namespace fbvins {
namespace v4l2_source_test {

using namespace running_source;

constexpr std::chrono::seconds kPatience{10};

TEST(V4l2Source, PutsTwoCamerasTogether) {
  FakeVideo left("/fake/left", {fourcc("MJPG"), fourcc("YUYV")}), right("/fake/right", {fourcc("GREY")});
  Running running("/fake/left,/fake/right,udp:127.0.0.1:9:0", small_rig());
  CollectedInput got;
  running.start(got);
  // Stamps at a camera's pace, however fast they come: within 2 ms another frame's image would be a partner as good.
  const Time begin = host_now();
  for (int i = 0; i < 8; ++i) {
    const Time t = begin + Duration{i * 33 * kMs};
    ASSERT_TRUE(deliver(left, t, filled((128 + 32) * 48, 10 + i)));
    ASSERT_TRUE(deliver(right, t + Duration{kMs / 2}, filled((64 + 32) * 48, 30 + i)));
    if (i == 3) left.damage_next();
  }
  ASSERT_TRUE(got.wait_for_frames(8, kPatience));
  int pairs = 0;
  for (const StereoFrame& frame : got.frames) {
    if (!frame.left() || !frame.right()) continue;
    ++pairs;
    EXPECT_EQ(frame.right()->at(63, 47) - frame.left()->at(0, 0), 20);
  }
  EXPECT_EQ(pairs, 7) << "a damaged image is none";
  EXPECT_TRUE(running.heard("64 x 48 pixels of YUYV"));
}

TEST(V4l2Source, CutsOneCameraInTwo) {
  FakeVideo both("/fake/both", {fourcc("GREY")});
  Running running("/fake/both,udp:127.0.0.1:9:0", small_rig());
  CollectedInput got;
  running.start(got);
  std::vector<std::uint8_t> bytes = filled((128 + 32) * 48, 1);
  for (std::size_t y = 0; y < 48; ++y)
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(y * 160 + 64), 64, std::uint8_t{2});
  ASSERT_TRUE(deliver(both, Time{5}, bytes));
  ASSERT_TRUE(got.wait_for_frames(1, kPatience));
  EXPECT_EQ(got.frames[0].left()->at(63, 47), 1);
  EXPECT_EQ(got.frames[0].right()->at(0, 0), 2);
}

StereoRig rig_of_three() {
  StereoRig rig = small_rig();
  rig.cameras.push_back({Camera(PinholeRadtan{50, 50, 15.5, 11.5, 0, 0, 0, 0}, 32, 24), {Quat::Identity(), Vec3(0.2, 0, 0)}});
  return rig;
}

TEST(V4l2Source, PutsThreeCamerasTogether) {
  FakeVideo left("/fake/left", {fourcc("GREY")}), right("/fake/right", {fourcc("GREY")}), small("/fake/small", {fourcc("GREY")});
  Running running("/fake/left,/fake/right,/fake/small,udp:127.0.0.1:9:0", rig_of_three());
  CollectedInput got;
  running.start(got);
  const Time begin = host_now();
  for (int i = 0; i < 3; ++i) {
    const Time t = begin + Duration{i * 33 * kMs};
    ASSERT_TRUE(deliver(left, t, filled((64 + 32) * 48, 10 + i)));
    ASSERT_TRUE(deliver(right, t, filled((64 + 32) * 48, 30 + i)));
    ASSERT_TRUE(deliver(small, t, filled((32 + 32) * 24, 50 + i)));
  }
  ASSERT_TRUE(got.wait_for_frames(3, kPatience));
  ASSERT_TRUE(got.frames[1].image(2));
  EXPECT_EQ(got.frames[1].image(2)->width(), 32);
  EXPECT_EQ(got.frames[1].image(2)->at(31, 23) - got.frames[1].left()->at(0, 0), 40);
}

TEST(V4l2Source, OneDeviceMayHaveOneCameraOrSeveralSideBySide) {
  StereoRig alike = small_rig();
  alike.cameras.push_back({alike.left(), {Quat::Identity(), Vec3(0.2, 0, 0)}});
  for (const StereoRig& rig : {with_one_camera(alike), alike}) {
    const int cameras = rig.camera_count();
    FakeVideo device("/fake/all", {fourcc("GREY")});
    Running running("/fake/all,udp:127.0.0.1:9:0", rig);
    CollectedInput got;
    running.start(got);
    std::vector<std::uint8_t> bytes = filled(static_cast<std::size_t>(64 * cameras + 32) * 48, 1);
    bytes[static_cast<std::size_t>(64 * cameras - 1)] = 7;
    ASSERT_TRUE(deliver(device, Time{5}, bytes));
    ASSERT_TRUE(got.wait_for_frames(1, kPatience));
    EXPECT_EQ(got.frames[0].image(cameras - 1)->at(63, 0), 7);
    EXPECT_EQ(got.frames[0].right() != nullptr, cameras > 1);
  }
}

TEST(V4l2Source, DevicesAreThoseOfTheCalibration) {
  const KalibrFiles three(rig_of_three());
  SourceOptions options;
  options.dataset.kalibr_camchain = three.camchain();
  const auto said = [&](const char* devices) { return V4l2Source::open(devices, options).error().message; };
  EXPECT_NE(said("/a,/b,udp:127.0.0.1:9:0").find("has 3 cameras, and there are 2 video devices"), std::string::npos);
  EXPECT_NE(said("/a,udp:127.0.0.1:9:0").find("camera 2 has another than camera 0"), std::string::npos);
  options.dataset.kalibr_camchain = "";
  options.uncalibrated = small_rig();
  const auto source = V4l2Source::open("/a,/b,/c,/d,udp:127.0.0.1:9:0", options);
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->rig().camera_count(), 4) << "to calibrate";
}

TEST(V4l2Source, WaitsForACameraThatIsUnplugged) {
  auto camera = std::make_unique<FakeVideo>("/fake/both", std::vector{fourcc("GREY")});
  Running running("/fake/both,udp:127.0.0.1:9:0", small_rig());
  CollectedInput got;
  running.start(got);
  const Time begin = host_now();
  ASSERT_TRUE(deliver(*camera, begin, filled(160 * 48, 1)));
  ASSERT_TRUE(got.wait_for_frames(1, kPatience));
  camera.reset();
  EXPECT_TRUE(running.heard("is gone"));
  camera = std::make_unique<FakeVideo>("/fake/both", std::vector{fourcc("GREY")});
  // Nearer than a frame's tolerance the image would belong to the first frame, and come too late for it.
  ASSERT_TRUE(deliver(*camera, begin + Duration{33 * kMs}, filled(160 * 48, 2)));
  ASSERT_TRUE(got.wait_for_frames(2, kPatience));
}

TEST(V4l2Source, SaysWhatIsWrong) {
  FakeVideo narrow("/fake/narrow", {fourcc("GREY")}, 100), colours("/fake/colours", {fourcc("RGB3")}),
      silent("/fake/silent", {fourcc("GREY")});
  silent.say_no_time();
  {
    Running running("/fake/narrow,/fake/colours,udp:127.0.0.1:9:0", [] {
      StereoRig rig = small_rig();
      for (MountedCamera& mounted : rig.cameras) mounted.camera = Camera(PinholeRadtan{100, 100, 60, 23.5, 0, 0, 0, 0}, 128, 48);
      return rig;
    }());
    CollectedInput got;
    running.start(got);
    EXPECT_TRUE(running.heard("delivers 100 x 48 pixels of GREY, wanted are 128 x 48"));
    EXPECT_TRUE(running.heard("has formats RGB3"));
  }
  Running running("/fake/silent,/fake/none,udp:127.0.0.1:9:0", small_rig());
  CollectedInput got;
  running.start(got);
  EXPECT_TRUE(running.heard("/fake/none: cannot be opened: No such file"));
  ASSERT_TRUE(deliver(silent, Time{1}, filled(96 * 48, 1)));
  EXPECT_TRUE(running.heard("gives no time stamps"));
  EXPECT_TRUE(running.heard("no flight controller is heard"));
}

TEST(V4l2Source, RefusesWordsItDoesNotUnderstand) {
  for (const char* text : {"", "/dev/video0", "/dev/video0,,udp:127.0.0.1:9:0", "0,1,2,3,4,5,6,7,8,udp:127.0.0.1:9:0"})
    EXPECT_FALSE(parse_v4l2_devices(text)) << text;
  const KalibrFiles files(small_rig());
  SourceOptions options;
  EXPECT_FALSE(V4l2Source::open("/dev/video0,udp:127.0.0.1:9:0", options)) << "no calibration";
  options.uncalibrated = small_rig();
  EXPECT_TRUE(V4l2Source::open("/dev/video0,udp:127.0.0.1:9:0", options)) << "to calibrate";
  options.dataset.kalibr_camchain = files.camchain();
  EXPECT_FALSE(V4l2Source::open("/dev/video0,/dev/imu", options)) << "no kind of IMU";
}

}  // namespace v4l2_source_test
}  // namespace fbvins
