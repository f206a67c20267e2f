// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_quality.hpp"

#include <dds/dds.h>
#include <gtest/gtest.h>

#include "fbvins/ros2/dds_wire.hpp"
#include "tests/support/ros2_test_graph.hpp"

namespace fbvins {
namespace ros2_quality_test {

TEST(Ros2Qos, IsParsedOrRefusedWithItsPart) {
  const auto wishes = parse_ros2_qos("odometry=best_effort/1,/tf=reliable/transient_local,path=volatile");
  ASSERT_TRUE(wishes) << wishes.error().message;
  ASSERT_EQ(wishes->size(), 3u);
  EXPECT_EQ(wishes->at("odometry").reliable, false);
  EXPECT_EQ(wishes->at("odometry").depth, 1);
  EXPECT_FALSE(wishes->at("odometry").latched);
  EXPECT_EQ(wishes->at("/tf").latched, true);
  EXPECT_EQ(wishes->at("path").latched, false);
  EXPECT_TRUE(parse_ros2_qos("")->empty());
  for (const char* bad : {"odometry", "odometry=", "=reliable", "odometry=fast", "odometry=0", "odometry=1x",
                          "odometry=reliable/", "a b=1", "odometry=99999", ",", "odometry=1,,"}) {
    const auto refused = parse_ros2_qos(bad);
    ASSERT_FALSE(refused) << bad;
    EXPECT_NE(refused.error().message.find("live.ros2.qos"), std::string::npos);
  }
}

TEST(Ros2Qos, IsThatOfTheTopicAndOfNoOther) {
  const auto joined =
      Ros2Node::join({.domain = 99}, {"/", "drone"}, false, *parse_ros2_qos("odometry=best_effort/1,/tf=7,nothing=3"));
  ASSERT_TRUE(joined) << joined.error().message;
  Ros2Node& node = **joined;
  const Ros2Quality odometry = node.quality("/drone/odometry", {.depth = 10});
  EXPECT_FALSE(odometry.reliable);
  EXPECT_EQ(odometry.depth, 1);
  const Ros2Quality transforms = node.quality("/tf", {.latched = true, .depth = 100});
  EXPECT_TRUE(transforms.reliable && transforms.latched);
  EXPECT_EQ(transforms.depth, 7);
  EXPECT_EQ(node.quality("/other/odometry", {.depth = 10}).depth, 10);
  EXPECT_EQ(node.unused_wish(), "nothing");
}

/// Of a reader that insists on reliability.
DdsEntity reliable_reader(const Ros2Node& node, const std::string& topic) {
  const std::string type = "nav_msgs/msg/Odometry";
  const auto made = make_wire_topic(node.participant(), wire_topic(topic), type);
  EXPECT_TRUE(made);
  return DdsEntity(
      dds_create_reader(node.participant(), made->entity.handle(), make_qos({.reliable = true}, type).get(), nullptr));
}

TEST(Ros2Qos, ABestEffortPublisherIsNotHeardByAReliableReader) {
  const auto joined = Ros2Node::join({.domain = 98}, {"/", "drone"}, false, *parse_ros2_qos("odometry=best_effort"));
  ASSERT_TRUE(joined) << joined.error().message;
  const auto odometry = Ros2Publisher::create(*joined, "/drone/odometry", "nav_msgs/msg/Odometry");
  const auto other = Ros2Publisher::create(*joined, "/drone/other", "nav_msgs/msg/Odometry");
  ASSERT_TRUE(odometry && other);
  const DdsEntity on_odometry = reliable_reader(**joined, "/drone/odometry"),
                  on_other = reliable_reader(**joined, "/drone/other");
  for (int i = 0; i < 1000 && other->subscribers() == 0; ++i) dds_sleepfor(DDS_MSECS(5));
  EXPECT_EQ(other->subscribers(), 1);
  EXPECT_EQ(odometry->subscribers(), 0);
}

}  // namespace ros2_quality_test
}  // namespace fbvins
