// SPDX-License-Identifier: Apache-2.0
// The source that --source names: devices, and whatever else there is (make_source.hpp). ROS 2's is in ros_graph.hpp.
#pragma once

#include <memory>
#include <string>

#include "fbvins/live/make_source.hpp"

namespace fbvins::app {

/// d435i[:SERIAL or FILE.bag], v4l2:LEFT,RIGHT,IMU, or as make_source() has it. An error where this program was built without
/// what the source needs.
Result<std::unique_ptr<Source>> open_source(const std::string& name, const SourceOptions& options);

}  // namespace fbvins::app
