// SPDX-License-Identifier: Apache-2.0
#include "apps/ros_graph.hpp"

#ifdef FBVINS_WITH_ROS2
#include "fbvins/ros2/ros2_node.hpp"
#include "fbvins/ros2/ros2_sink.hpp"
#include "fbvins/ros2/ros2_source.hpp"
#endif

namespace fbvins::app {
namespace {

constexpr std::string_view kSourceKind = "ros2:";

}  // namespace

#ifdef FBVINS_WITH_ROS2

Result<RosGraph> RosGraph::join(const std::string& address, const std::string& source, const Ros2Options& options) {
  RosGraph graph;
  graph.publishes_ = !address.empty();
  if (source.starts_with(kSourceKind)) graph.topics_ = source.substr(kSourceKind.size());
  if (!graph.publishes_ && !source.starts_with(kSourceKind)) return graph;
  if (source.starts_with(kSourceKind))
    if (const auto topics = parse_ros2_topics(graph.topics_); !topics) return topics.error();
  const auto parsed = parse_ros2_address(graph.publishes_ ? address : "0");
  if (!parsed) return parsed.error();
  const auto name = parse_ros2_node(options.node);
  if (!name) return name.error();
  auto node = Ros2Node::join(*parsed, *name, options.distribution == Ros2Distribution::humble);
  if (!node) return node.error();
  graph.node_ = std::move(*node);
  return graph;
}

Result<std::unique_ptr<Source>> RosGraph::open_source(const SourceOptions& options) const {
  auto source = Ros2Source::open(node_, *parse_ros2_topics(topics_), options);
  if (!source) return source.error();
  return std::unique_ptr<Source>(std::move(*source));
}

Result<void> RosGraph::add_sink(const Source& source, const LiveOptions& options, LiveSystem& live) const {
  if (!publishes_) return {};
  auto sink = Ros2Sink::create(node_, source.rig(), options);
  if (!sink) return sink.error();
  live.add_sink(std::move(*sink));
  return {};
}

#else

Result<RosGraph> RosGraph::join(const std::string& address, const std::string& source, const Ros2Options&) {
  if (address.empty() && !source.starts_with(kSourceKind)) return RosGraph{};
  return Error{ErrorCode::invalid_argument, "this program was built without CycloneDDS, which ROS 2 topics need"};
}
Result<std::unique_ptr<Source>> RosGraph::open_source(const SourceOptions&) const {
  return Error{ErrorCode::invalid_argument, "this program was built without ROS 2 topics"};
}
Result<void> RosGraph::add_sink(const Source&, const LiveOptions&, LiveSystem&) const { return {}; }

#endif

}  // namespace fbvins::app
