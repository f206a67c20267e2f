// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_sink.hpp"

#include <gtest/gtest.h>

#include <array>
#include <ctime>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/io/ros_messages.hpp"
#include "tests/support/ros2_test_graph.hpp"
#include "tests/support/socket_test_sender.hpp"

namespace fbvins {
namespace ros2_sink_test {

using test::Heard;
using test::node;

const Health kGood{HealthState::good, HealthReason::none};

LivePose pose_at(int ms) {
  LivePose pose;
  pose.t = Time{ms * 1'000'000LL};
  pose.T_WB.p = Vec3(0.001 * ms, 2, 3);
  pose.health = kGood;
  return pose;
}

TEST(Ros2Sink, AnOdometryMessageForEveryPoseAndTransformsFiftyTimesASecond) {
  Heard odometry, transforms;
  const auto on_odometry = Ros2Subscriber::create(node(), "/fbvins/odometry", "nav_msgs/msg/Odometry", 2000, odometry.function());
  const auto on_transforms = Ros2Subscriber::create(node(), "/tf", "tf2_msgs/msg/TFMessage", 2000, transforms.function());
  auto sink = Ros2Sink::create(node(), {});
  ASSERT_TRUE(sink) << sink.error().message;
  for (int ms = 5; ms <= 1000; ms += 5) ASSERT_TRUE((*sink)->take(LiveEvent(pose_at(ms))));
  LivePose none = pose_at(1005);
  none.health = {HealthState::lost, HealthReason::no_images};
  ASSERT_TRUE((*sink)->take(LiveEvent(none)));
  MapUpdate update;
  update.localised = true;
  update.T_MW.p = Vec3(0, 0, 7);
  ASSERT_TRUE((*sink)->take(LiveEvent(update)));
  ASSERT_TRUE((*sink)->take(LiveEvent(pose_at(1020))));
  ASSERT_TRUE(odometry.wait_for(201));
  EXPECT_EQ(odometry.messages().size(), 201u) << "without a pose there is no message";
  const auto last = read_odometry(odometry.messages().back());
  ASSERT_TRUE(last);
  EXPECT_EQ(last->t, pose_at(1020).t);
  EXPECT_EQ(last->p, pose_at(1020).T_WB.p);
  ASSERT_TRUE(transforms.wait_for(51));
  EXPECT_EQ(transforms.messages().size(), 51u);
  std::string with_map;
  const std::array expected = {RosTransform{"odom", "base_link", Quat::Identity(), pose_at(1020).T_WB.p},
                               RosTransform{"map", "odom", Quat::Identity(), Vec3(0, 0, 7)}};
  append_transforms(with_map, pose_at(1020).t, expected);
  EXPECT_EQ(transforms.messages().back(), with_map);
}

TEST(Ros2Sink, TheFirstMessageAfterAResetHasNoInformation) {
  Heard odometry, transforms;
  const auto on_odometry = Ros2Subscriber::create(node(), "/fbvins/odometry", "nav_msgs/msg/Odometry", 2000, odometry.function());
  const auto on_transforms = Ros2Subscriber::create(node(), "/tf", "tf2_msgs/msg/TFMessage", 2000, transforms.function());
  LiveOptions options;
  options.ros2.publish_tf = false;
  auto sink = Ros2Sink::create(node(), {}, options);
  ASSERT_TRUE(sink) << sink.error().message;
  for (int ms = 100; ms <= 500; ms += 100) {
    LivePose pose = pose_at(ms);
    pose.pose_covariance = 0.25 * Mat6::Identity();
    pose.reset_counter = ms < 300 ? 4 : 5;
    ASSERT_TRUE((*sink)->take(LiveEvent(pose)));
  }
  ASSERT_TRUE(odometry.wait_for(5));
  const double nothing_known = 9999;
  const std::string_view bytes(reinterpret_cast<const char*>(&nothing_known), sizeof(nothing_known));
  std::vector<int> times;
  for (const std::string& message : odometry.messages()) {
    times.push_back(0);
    for (std::size_t at = message.find(bytes); at != message.npos; at = message.find(bytes, at + bytes.size())) ++times.back();
  }
  EXPECT_EQ(times, (std::vector<int>{0, 0, 12, 0, 0})) << "of pose and twist, to the last bit";
  EXPECT_TRUE(transforms.messages().empty());
}

TEST(Ros2Sink, ThePathIsThinnedAndBeginsAnewWithTheOdometry) {
  Heard paths;
  const auto on_path = Ros2Subscriber::create(node(), "/fbvins/path", "nav_msgs/msg/Path", 100, paths.function());
  auto sink = Ros2Sink::create(node(), {});
  ASSERT_TRUE(sink);
  Trajectory<W> expected;
  for (int k = 0; k <= 20; ++k) {
    Odometry o;
    o.t = Time{k * 50'000'000LL + 1};
    o.T_WB.p = Vec3(0.03 * k, 0, 0);
    o.health = kGood;
    if (k % 2 == 0) expected.push_back({o.t, o.T_WB});
    ASSERT_TRUE((*sink)->take(LiveEvent(o)));
  }
  ASSERT_TRUE(paths.wait_for(2));
  std::string bytes;
  append_path(bytes, expected.back().t, expected);
  EXPECT_EQ(paths.messages().back(), bytes);
  Odometry anew;
  anew.t = Time{9'000'000'000};
  anew.health = kGood;
  anew.reset_counter = 1;
  ASSERT_TRUE((*sink)->take(LiveEvent(anew)));
  ASSERT_TRUE(paths.wait_for(3));
  bytes.clear();
  append_path(bytes, anew.t, {{anew.t, anew.T_WB}});
  EXPECT_EQ(paths.messages().back(), bytes);
}

/// A camera that looks ahead, turned to the left by the mounting and ahead of the vehicle's middle: x right, y down, z forward.
TEST(Ros2Sink, ThePoseIsThatOfTheVehicle) {
  Heard odometry;
  LiveOptions options;
  options.ros2.odometry_frame = "drone/odom";
  options.ros2.imu_frame = "drone/imu";
  options.ros2.base_frame = "drone/base";
  options.mavlink.mounting.imu_axes = ImuAxes::camera_fwd;
  options.mavlink.mounting.x_m = 0.2;
  const auto on_odometry = Ros2Subscriber::create(node(), "/fbvins/odometry", "nav_msgs/msg/Odometry", 10, odometry.function());
  const auto sink = Ros2Sink::create(node(), test::socket_test_rig(), options);
  ASSERT_TRUE(sink) << sink.error().message;
  LivePose level = pose_at(10);  // looks along W's y
  level.T_WB.q = Quat((Mat3() << 1, 0, 0, 0, 0, 1, 0, -1, 0).finished());
  ASSERT_TRUE((*sink)->take(LiveEvent(level)));
  ASSERT_TRUE(odometry.wait_for(1));
  const std::string message = odometry.messages().back();
  const auto pose = read_odometry(message);
  ASSERT_TRUE(pose);
  EXPECT_LT((pose->q * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-12) << "forward";
  EXPECT_LT((pose->q * Vec3::UnitZ() - Vec3::UnitZ()).norm(), 1e-12) << "up";
  EXPECT_LT((pose->p - (level.T_WB.p - Vec3(0, 0.2, 0))).norm(), 1e-12) << "the camera is ahead of the middle";
  EXPECT_NE(message.find("drone/odom"), std::string::npos);
  EXPECT_NE(message.find("drone/base"), std::string::npos);
}

TEST(Ros2Sink, FixedTransformsAreTheMountingAndTheCameras) {
  Heard fixed;
  const auto on_fixed = Ros2Subscriber::create(node(), "/tf_static", "tf2_msgs/msg/TFMessage", 10, fixed.function());
  LiveOptions options;
  options.ros2.base_frame = "";
  const StereoRig rig = test::socket_test_rig();
  ASSERT_TRUE(Ros2Sink::create(node(), rig, options));
  std::string expected;
  append_transforms(expected, Time{},
                    std::array{RosTransform{"imu_link", "camera0_optical", rig.T_BC0().q, rig.T_BC0().p},
                               RosTransform{"imu_link", "camera1_optical", rig.T_BC1().q, rig.T_BC1().p}});
  ASSERT_TRUE(fixed.wait_for(1));
  EXPECT_EQ(fixed.messages().back(), expected);
  ASSERT_TRUE(Ros2Sink::create(node(), rig));
  ASSERT_TRUE(fixed.wait_for(2));
  EXPECT_NE(fixed.messages().back().find("base_link"), std::string::npos);
}

TEST(Ros2Sink, StampsMayBeInRosTime) {
  Heard odometry, paths;
  LiveOptions options;
  options.ros2.clock = Ros2Clock::ros;
  const auto on_odometry = Ros2Subscriber::create(node(), "/fbvins/odometry", "nav_msgs/msg/Odometry", 10, odometry.function());
  const auto on_path = Ros2Subscriber::create(node(), "/fbvins/path", "nav_msgs/msg/Path", 10, paths.function());
  const auto sink = Ros2Sink::create(node(), {}, options);
  ASSERT_TRUE(sink);
  timespec monotonic{}, real{};
  clock_gettime(CLOCK_MONOTONIC, &monotonic);
  clock_gettime(CLOCK_REALTIME, &real);
  LivePose pose = pose_at(1000);
  pose.host_t = Time{monotonic.tv_sec * 1'000'000'000LL + monotonic.tv_nsec - 50'000'000};
  ASSERT_TRUE((*sink)->take(LiveEvent(pose)));
  ASSERT_TRUE(odometry.wait_for(1));
  const double ago_s = static_cast<double>(real.tv_sec) + 1e-9 * static_cast<double>(real.tv_nsec) -
                       read_odometry(odometry.messages().back())->t.seconds();
  EXPECT_NEAR(ago_s, 0.05, 0.02) << "the reading is 50 ms old";
  Odometry o;
  o.t = pose.t;
  o.health = kGood;
  ASSERT_TRUE((*sink)->take(LiveEvent(o)));
  ASSERT_TRUE(paths.wait_for(1));
  const Time t = read_odometry(odometry.messages().back())->t;
  std::string expected;
  append_path(expected, t, {{t, o.T_WB}});
  EXPECT_EQ(paths.messages().back(), expected);
}

TEST(Ros2Sink, FramesHaveNamesOfTheirOwn) {
  LiveOptions options;
  options.ros2.base_frame = "";
  EXPECT_TRUE(Ros2Sink::create(node(), {}, options)) << "the IMU itself";
  for (const char* wrong : {"", "/odom", "a b", "map"}) {
    options.ros2.odometry_frame = wrong;
    const auto refused = Ros2Sink::create(node(), {}, options);
    ASSERT_FALSE(refused) << wrong;
    EXPECT_NE(refused.error().message.find("ROS 2 frame"), std::string::npos);
  }
}

TEST(Ros2Sink, DiagnosticsSayHealth) {
  Heard diagnostics;
  const auto on_status =
      Ros2Subscriber::create(node(), "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", 10, diagnostics.function());
  auto sink = Ros2Sink::create(node(), {});
  ASSERT_TRUE(sink);
  LiveStatus status;
  status.health = {HealthState::lost, HealthReason::no_images};
  ASSERT_TRUE((*sink)->take(LiveEvent(status))) << "before any sensor there is no time to say it at";
  status.t = Time{5'000'000'000};
  ASSERT_TRUE((*sink)->take(LiveEvent(status)));
  ASSERT_TRUE(diagnostics.wait_for(1));
  ASSERT_EQ(diagnostics.messages().size(), 1u);
  EXPECT_NE(diagnostics.messages()[0].find("lost: no_images"), std::string::npos);
  EXPECT_NE(diagnostics.messages()[0].find("fbvins: live"), std::string::npos);
}

}  // namespace ros2_sink_test
}  // namespace fbvins
