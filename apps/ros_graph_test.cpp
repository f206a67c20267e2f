// SPDX-License-Identifier: Apache-2.0
#include "apps/ros_graph.hpp"

#include <gtest/gtest.h>

namespace fbvins::app {
namespace ros_graph_test {

TEST(RosGraph, SpeaksAsTheEnvironmentsDistribution) {
  EXPECT_TRUE(speaks_as_humble(Ros2Distribution::environment, "humble"));
  for (const char* later : {"iron", "jazzy", "rolling", ""}) EXPECT_FALSE(speaks_as_humble(Ros2Distribution::environment, later));
  EXPECT_FALSE(speaks_as_humble(Ros2Distribution::environment, nullptr));
  EXPECT_FALSE(speaks_as_humble(Ros2Distribution::iron, "humble")) << "what is set counts";
  EXPECT_TRUE(speaks_as_humble(Ros2Distribution::humble, "jazzy"));
}

TEST(RosGraph, WithoutAnAddressThereIsNone) {
  const auto graph = RosGraph::join("", "replay:nothing", {});
  ASSERT_TRUE(graph) << graph.error().message;
  EXPECT_FALSE(graph->has_source());
  EXPECT_FALSE(RosGraph::join("nonsense", "replay:nothing", {}));
}

}  // namespace ros_graph_test
}  // namespace fbvins::app
