// SPDX-License-Identifier: Apache-2.0
// `fbvins live` in ROS 2's graph: what --ros2 and a source ros2:CAM0,...,IMU ask for. In a program built without
// CycloneDDS both are an error.
#pragma once

#include <memory>
#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/live/live_system.hpp"
#include "fbvins/live/make_source.hpp"

namespace fbvins {
class Ros2Node;
}

namespace fbvins::app {

/// Whether Humble's form of the message that tells of nodes is wanted. `ros_distro`: the environment's ROS_DISTRO, or null.
bool speaks_as_humble(Ros2Distribution distribution, const char* ros_distro);

class RosGraph {
 public:
  /// `address`: DOMAIN[:INTERFACE], empty: publish nothing. `source`: the flight's source, of any kind.
  static Result<RosGraph> join(const std::string& address, const std::string& source, const Ros2Options& options);

  bool has_source() const { return !topics_.empty(); }
  Result<std::unique_ptr<Source>> open_source(const SourceOptions& options) const;
  /// Publishes the flight.
  Result<void> add_sinks(const Source& source, const LiveOptions& options, LiveSystem& live) const;

 private:
  std::shared_ptr<Ros2Node> node_;
  std::string topics_;
  bool publishes_ = false;
};

}  // namespace fbvins::app
