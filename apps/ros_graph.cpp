// SPDX-License-Identifier: Apache-2.0
#include "apps/ros_graph.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "apps/terminal.hpp"
#include "fbvins/config/option_tiers.hpp"

#ifdef FBVINS_WITH_ROS2
#include "fbvins/ros2/ros2_control.hpp"
#include "fbvins/ros2/ros2_image_sink.hpp"
#include "fbvins/ros2/ros2_node.hpp"
#include "fbvins/ros2/ros2_sink.hpp"
#include "fbvins/ros2/ros2_source.hpp"
#endif

namespace fbvins::app {
namespace {

constexpr std::string_view kSourceKind = "ros2:";

RosParameter parameter_of(const OptionField& field) {
  RosParameter out{field.path, {}, field.meaning, field.range_text(), field.min, field.max};
  if (!field.unit.empty()) out.description += " [" + field.unit + "]";
  if (bool* const* yes = std::get_if<bool*>(&field.value)) out.value = **yes;
  else if (int* const* whole = std::get_if<int*>(&field.value)) out.value = std::int64_t{**whole};
  else if (double* const* number = std::get_if<double*>(&field.value)) out.value = **number;
  else out.value = field.value_text();
  return out;
}

}  // namespace

std::vector<RosParameter> ros_parameters(Config config) {
  const auto users = user_options();
  std::vector<RosParameter> out;
  for (const OptionField& field : fields_of(config)) {
    const bool shown = field.path.starts_with("live.") || std::ranges::find(users, field.path) != users.end();
    if (shown && !field.is_group()) out.push_back(parameter_of(field));
  }
  return out;
}

std::vector<FlightCommand> ros_commands(std::vector<FlightCommand> commands, const Ros2Options& options) {
  if (!options.commands) commands.clear();
  return commands;
}

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

Result<void> RosGraph::add_sinks(const Source& source, const Config& config, std::vector<FlightCommand> commands,
                                 LiveSystem& live) const {
  if (!publishes_) return {};
  auto sink = Ros2Sink::create(node_, source.rig(), config.live);
  if (!sink) return sink.error();
  auto control = Ros2Control::create(node_, ros_commands(std::move(commands), config.live.ros2), ros_parameters(config), warn);
  if (!control) return control.error();
  auto images = Ros2ImageSink::create(node_, source.rig(), config.live.ros2);
  if (!images) return images.error();
  if (const auto heard = parse_ros2_topics(topics_); !topics_.empty() && heard) {  // the source subscribes when it runs
    for (const std::string& topic : heard->cameras) (void)node_->quality(topic, {});
    for (const std::string& topic : {heard->imu, heard->depth}) (void)node_->quality(topic, {});
  }
  if (const std::string topic = node_->unused_wish(); !topic.empty())
    return Error{ErrorCode::invalid_argument, fmt::format("live.ros2.qos: this flight has no topic '{}'", topic)};
  live.add_sink(std::move(*sink));
  live.add_sink(std::move(*images));
  live.add_sink(std::move(*control));
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
Result<void> RosGraph::add_sinks(const Source&, const Config&, std::vector<FlightCommand>, LiveSystem&) const { return {}; }

#endif

}  // namespace fbvins::app
