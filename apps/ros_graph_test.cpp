// SPDX-License-Identifier: Apache-2.0
#include "apps/ros_graph.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace fbvins::app {
namespace ros_graph_test {

TEST(RosParameters, AreTheUsersOptionsAndAllOfLive) {
  Config config;
  config.live.smoothing_s = 0.25;
  config.estimator.max_iterations = 7;
  const std::vector<RosParameter> all = ros_parameters(config);
  const auto find = [&](const char* name) {
    const auto found = std::ranges::find(all, name, &RosParameter::name);
    return found == all.end() ? RosParameter{} : *found;
  };
  using Value = decltype(RosParameter::value);
  EXPECT_EQ(find("live.smoothing_s").value, Value(0.25));
  EXPECT_EQ(find("live.smoothing_s").max, 2.0);
  EXPECT_NE(find("live.smoothing_s").description.find("[s]"), std::string::npos);
  EXPECT_EQ(find("estimator.max_iterations").value, Value(std::int64_t{7}));
  EXPECT_EQ(find("frontend.kind").constraints, "klt|orb|boost");
  EXPECT_EQ(find("live.ros2.clock").value, Value(std::string("sensors")));
  EXPECT_EQ(find("live.ros2.commands").value, Value(true));
  EXPECT_EQ(find("live.ros2").name, "") << "a group is no parameter";
  EXPECT_EQ(find("estimator.max_pending_m").name, "") << "for experts";
}

TEST(RosCommands, AreNoneWhereTheUserWantsNone) {
  Config config;
  const std::vector<FlightCommand> all = {{"reset", [](const FlightCommand::Told&) {}},
                                          {"save_map", [](const FlightCommand::Told&) {}}};
  EXPECT_EQ(ros_commands(all, config.live.ros2).size(), 2u);
  config.live.ros2.commands = false;
  EXPECT_TRUE(ros_commands(all, config.live.ros2).empty());
}

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
