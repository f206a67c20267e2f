// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_image_sink.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <ctime>

#include "fbvins/io/ros_messages.hpp"
#include "fbvins/live/view_landmarks.hpp"
#include "tests/support/ros2_test_graph.hpp"
#include "tests/support/socket_test_sender.hpp"

namespace fbvins {
namespace ros2_image_sink_test {

using test::Heard;
using test::node;

std::unique_ptr<Ros2ImageSink> sink_with(const Ros2Options& options = {}) {
  auto made = Ros2ImageSink::create(node(), test::socket_test_rig(), options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return made ? std::move(*made) : nullptr;
}

StereoFrame frame_at(Time t) {
  const auto image = [](std::uint8_t grey) { return std::make_shared<const Image>(8, 6, grey); };
  return {t, {image(1), image(2)}};
}

TEST(Ros2ImageSink, PublishesWhatSomebodyListensTo) {
  const auto sink = sink_with();
  ASSERT_TRUE(sink);
  Heard right, info;
  StereoFrame frame = frame_at(Time{1'000'000'000});
  ASSERT_TRUE(sink->take(LiveEvent(frame))) << "to nobody";
  {
    const auto on_right =
        Ros2Subscriber::create(node(), "/fbvins/camera1/image_raw", "sensor_msgs/msg/Image", 10, right.function());
    const auto on_info =
        Ros2Subscriber::create(node(), "/fbvins/camera0/camera_info", "sensor_msgs/msg/CameraInfo", 10, info.function());
    ASSERT_TRUE(on_right && on_info);
    frame.offsets.set(1, Duration{7});
    ASSERT_TRUE(sink->take(LiveEvent(frame)));
    ASSERT_TRUE(right.wait_for(1) && info.wait_for(1));
    frame.set_image(1, nullptr);
    ASSERT_TRUE(sink->take(LiveEvent(frame))) << "without the right image";
    ASSERT_TRUE(info.wait_for(2));
  }
  ASSERT_TRUE(sink->take(LiveEvent(frame_at(Time{2'000'000'000}))));
  ASSERT_EQ(right.messages().size(), 1u);
  const std::string message = right.messages()[0];
  const auto image = read_image(message);
  ASSERT_TRUE(image);
  EXPECT_EQ(image->t, Time{1'000'000'007}) << "when this camera saw it";
  EXPECT_EQ(image->pixels, std::string(48, '\2'));
  std::string expected;
  append_camera_info(expected, Time{1'000'000'000}, "camera0_optical", test::socket_test_rig().left());
  EXPECT_EQ(info.messages()[0], expected);
}

TEST(Ros2ImageSink, DepthImagesAreThoseOfTheSensorAndThereOnlyWithOne) {
  StereoRig rig = test::socket_test_rig();
  rig.depth = DepthSensor{};
  auto made = Ros2ImageSink::create(node(), rig, {});
  ASSERT_TRUE(made) << made.error().message;
  Heard depths;
  const auto heard = Ros2Subscriber::create(node(), "/fbvins/depth/image_raw", "sensor_msgs/msg/Image", 10, depths.function());
  ASSERT_TRUE(heard);
  StereoFrame frame = frame_at(Time{1'000'000'000});
  ASSERT_TRUE((*made)->take(LiveEvent(frame))) << "without depth image";
  frame.depth = std::make_shared<DepthImage>(DepthImage{8, 6, std::vector<std::uint16_t>(48, 1234)});
  ASSERT_TRUE((*made)->take(LiveEvent(frame)));
  ASSERT_TRUE(depths.wait_for(1));
  const std::string message = depths.messages()[0];
  const auto image = read_image(message);
  ASSERT_TRUE(image);
  EXPECT_TRUE(image->is_depth()) << image->encoding;
  EXPECT_EQ(image->t, frame.t);
  ASSERT_EQ(image->pixels.size(), 96u);
  std::uint16_t mm = 0;
  std::memcpy(&mm, image->pixels.data() + 94, 2);
  EXPECT_EQ(mm, 1234);
  std::string expected;
  append_depth_image(expected, frame.t, "camera0_optical", *frame.depth);
  EXPECT_EQ(message, expected);
}

TEST(Ros2ImageSink, LandmarksAreMadeWhileSomebodyListens) {
  Ros2Options options;
  options.odometry_frame = "drone/odom";
  const auto sink = sink_with(options);
  ASSERT_TRUE(sink);
  EXPECT_FALSE(sink->wants_views());
  Heard points;
  LiveView view;
  view.t = Time{3'000'000'000};
  view.landmarks = {{TrackId{5}, Vec3(1, 2, 3)}};
  {
    const auto heard = Ros2Subscriber::create(node(), "/fbvins/landmarks", "sensor_msgs/msg/PointCloud2", 10, points.function());
    ASSERT_TRUE(heard);
    EXPECT_TRUE(sink->wants_views());
    ASSERT_TRUE(sink->take(LiveEvent(view)));
    ASSERT_TRUE(points.wait_for(1));
  }
  EXPECT_FALSE(sink->wants_views());
  std::string expected;
  append_landmarks(expected, view.t, landmarks_of(view), "drone/odom");
  EXPECT_EQ(points.messages()[0], expected);
}

TEST(Ros2ImageSink, InRosTimeThereIsNoImageBeforeTheClocksAreCompared) {
  Ros2Options options;
  options.clock = Ros2Clock::ros;
  const auto sink = sink_with(options);
  ASSERT_TRUE(sink);
  Heard left;
  const auto heard = Ros2Subscriber::create(node(), "/fbvins/camera0/image_raw", "sensor_msgs/msg/Image", 10, left.function());
  ASSERT_TRUE(heard);
  ASSERT_TRUE(sink->take(LiveEvent(frame_at(Time{1'000}))));
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  LivePose pose;
  pose.t = Time{2'000};
  pose.host_t = Time{now.tv_sec * 1'000'000'000LL + now.tv_nsec};
  ASSERT_TRUE(sink->take(LiveEvent(pose)));
  clock_gettime(CLOCK_REALTIME, &now);
  ASSERT_TRUE(sink->take(LiveEvent(frame_at(Time{2'000}))));
  ASSERT_TRUE(left.wait_for(1));
  ASSERT_EQ(left.messages().size(), 1u);
  const std::string message = left.messages()[0];
  EXPECT_NEAR(read_image(message)->t.seconds(), static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec), 0.5);
}

}  // namespace ros2_image_sink_test
}  // namespace fbvins
