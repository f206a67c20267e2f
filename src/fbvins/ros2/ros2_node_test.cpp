// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_node.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/ros2_test_graph.hpp"

namespace fbvins {
namespace ros2_node_test {

using test::Heard;
using test::node;

TEST(Ros2Address, IsADomainAndPerhapsAnInterface) {
  EXPECT_EQ(parse_ros2_address("42")->domain, 42u);
  EXPECT_EQ(parse_ros2_address("42")->interface, "");
  EXPECT_EQ(parse_ros2_address("0:eth0")->interface, "eth0");
  for (const char* wrong : {"", "x", "-1", "233", "1x", "1:", "1:a b", "1:\"/><x"})
    EXPECT_FALSE(parse_ros2_address(wrong)) << wrong;
}

TEST(Ros2Name, IsANameAndPerhapsANamespace) {
  EXPECT_EQ(parse_ros2_node("fbvins")->name, "fbvins");
  EXPECT_EQ(parse_ros2_node("fbvins")->name_space, "/");
  EXPECT_EQ(parse_ros2_node("/fbvins")->name_space, "/");
  EXPECT_EQ(parse_ros2_node("/a/b1/nav")->name_space, "/a/b1");
  EXPECT_EQ(parse_ros2_node("/a/b1/nav")->name, "nav");
  for (const char* wrong : {"", "/", "a/b", "/a/", "1a", "/1a/b", "a b", "//a", "/a//b", "a-b"})
    EXPECT_FALSE(parse_ros2_node(wrong)) << wrong;
}

TEST(Ros2Node, BytesArriveAsTheyWereSent) {
  Heard heard;
  auto subscriber = Ros2Subscriber::create(node(), "/bytes", "std_msgs/msg/String", 2000, heard.function());
  ASSERT_TRUE(subscriber) << subscriber.error().message;
  const auto publisher = Ros2Publisher::create(node(), "/bytes", "std_msgs/msg/String");
  ASSERT_TRUE(publisher) << publisher.error().message;
  std::vector<std::string> sent;
  for (std::size_t size : {4u, 5u, 6u, 7u, 1000u, 65'536u, 400'001u}) {
    std::string& message = sent.emplace_back(size, '\0');
    for (std::size_t k = 0; k < size; ++k) message[k] = static_cast<char>(k * 31 + size);
    ASSERT_TRUE(publisher->publish(message));
  }
  EXPECT_TRUE(heard.wait_for(sent.size()));
  EXPECT_EQ(heard.messages(), sent);
}

TEST(Ros2Node, ASubscriberAdaptsToThePublishersReliability) {
  Heard heard;
  auto subscriber = Ros2Subscriber::create(node(), "/offered", "std_msgs/msg/String", 10, heard.function());
  ASSERT_TRUE(subscriber);
  const auto publisher = Ros2Publisher::create(node(), "/offered", "std_msgs/msg/String", {.reliable = true});
  ASSERT_TRUE(publisher);
  ASSERT_TRUE((*subscriber)->look_around());
  EXPECT_EQ((*subscriber)->publishers(), 1);
  ASSERT_TRUE(publisher->publish(std::string("\0\1\0\0word", 8)));
  EXPECT_TRUE(heard.wait_for(1));
}

/// A best-effort reader hears both kinds of publishers, a reliable one only its own.
TEST(Ros2Node, AmongPublishersOfBothKindsASubscriberHearsAll) {
  Heard heard;
  auto subscriber = Ros2Subscriber::create(node(), "/both", "std_msgs/msg/String", 10, heard.function());
  ASSERT_TRUE(subscriber);
  const auto first = Ros2Publisher::create(node(), "/both", "std_msgs/msg/String", {.reliable = false});
  ASSERT_TRUE(first && (*subscriber)->look_around());
  {
    const auto second = Ros2Publisher::create(node(), "/both", "std_msgs/msg/String", {.reliable = true});
    ASSERT_TRUE(second && (*subscriber)->look_around());
    EXPECT_EQ((*subscriber)->publishers(), 2);
  }
  ASSERT_TRUE((*subscriber)->look_around());
  EXPECT_EQ((*subscriber)->publishers(), 1);
}

TEST(Ros2Node, ATopicOfAnotherTypeIsSaid) {
  Heard heard;
  auto subscriber = Ros2Subscriber::create(node(), "/typed", "sensor_msgs/msg/Imu", 10, heard.function());
  ASSERT_TRUE(subscriber);
  const auto other = Ros2Publisher::create(node(), "/typed", "sensor_msgs/msg/Image");
  if (!other) return;  // within one process creating the topic fails already
  const Result<void> looked = (*subscriber)->look_around();
  ASSERT_FALSE(looked);
  EXPECT_NE(looked.error().message.find("/typed carries sensor_msgs::msg::dds_::Image_"), std::string::npos);
}

TEST(Ros2Node, ATopicBeginsWithASlash) {
  EXPECT_FALSE(Ros2Publisher::create(node(), "tf", "tf2_msgs/msg/TFMessage"));
  EXPECT_FALSE(Ros2Publisher::create(node(), "", "tf2_msgs/msg/TFMessage"));
}

}  // namespace ros2_node_test
}  // namespace fbvins
