// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_sink.hpp"

#include <gtest/gtest.h>

#include "fbvins/io/ros_messages.hpp"
#include "fbvins/ros2/ros2_test_graph.hpp"

namespace fbvins {
namespace {

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
  const std::array expected = {RosTransform{kOdometryFrame, kBodyFrame, Quat::Identity(), pose_at(1020).T_WB.p},
                               RosTransform{kMapFrame, kOdometryFrame, Quat::Identity(), Vec3(0, 0, 7)}};
  append_transforms(with_map, pose_at(1020).t, expected);
  EXPECT_EQ(transforms.messages().back(), with_map);
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

}  // namespace
}  // namespace fbvins
