// SPDX-License-Identifier: Apache-2.0
#include "apps/ros_graph.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <utility>

#ifdef FBVINS_WITH_ROS2
#include "fbvins/ros2/ros2_image_sink.hpp"
#include "fbvins/ros2/ros2_node.hpp"
#include "fbvins/ros2/ros2_sink.hpp"
#include "fbvins/ros2/ros2_source.hpp"
#endif

namespace fbvins::app {
namespace {

constexpr std::string_view kSourceKind = "ros2:";

}  // namespace

bool speaks_as_humble(Ros2Distribution distribution, const char* ros_distro) {
  if (distribution != Ros2Distribution::environment) return distribution == Ros2Distribution::humble;
  constexpr std::string_view kBeforeIron[] = {"foxy", "galactic", "humble"};
  return ros_distro != nullptr && std::ranges::find(kBeforeIron, std::string_view(ros_distro)) != std::end(kBeforeIron);
}

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
  const auto qos = parse_ros2_qos(options.qos);
  if (!qos) return qos.error();
  auto node = Ros2Node::join(*parsed, *name, speaks_as_humble(options.distribution, std::getenv("ROS_DISTRO")), *qos);
  if (!node) return node.error();
  graph.node_ = std::move(*node);
  return graph;
}

Result<std::unique_ptr<Source>> RosGraph::open_source(const SourceOptions& options) const {
  auto source = Ros2Source::open(node_, *parse_ros2_topics(topics_), options);
  if (!source) return source.error();
  return std::unique_ptr<Source>(std::move(*source));
}

Result<void> RosGraph::add_sinks(const Source& source, const LiveOptions& options, LiveSystem& live) const {
  if (!publishes_) return {};
  auto sink = Ros2Sink::create(node_, source.rig(), options);
  if (!sink) return sink.error();
  auto images = Ros2ImageSink::create(node_, source.rig(), options.ros2);
  if (!images) return images.error();
  if (const auto heard = parse_ros2_topics(topics_); !topics_.empty() && heard) {  // the source subscribes when it runs
    for (const std::string& topic : heard->cameras) (void)node_->quality(topic, {});
    for (const std::string& topic : {heard->imu, heard->depth}) (void)node_->quality(topic, {});
  }
  if (const std::string topic = node_->unused_wish(); !topic.empty())
    return Error{ErrorCode::invalid_argument, fmt::format("live.ros2.qos: this flight has no topic '{}'", topic)};
  live.add_sink(std::move(*sink));
  live.add_sink(std::move(*images));
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
Result<void> RosGraph::add_sinks(const Source&, const LiveOptions&, LiveSystem&) const { return {}; }

#endif

}  // namespace fbvins::app
