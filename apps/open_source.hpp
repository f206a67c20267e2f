// SPDX-License-Identifier: Apache-2.0
// The source that --source names: devices, and the others of make_source.hpp. That of ROS 2 is in ros_graph.hpp.
#pragma once

#include <memory>
#include <string>

#include "fbvins/live/make_source.hpp"

namespace fbvins::app {

/// d435i[:SERIAL or FILE.bag], v4l2:CAM0,CAM1,...,IMU, a source of make_source(), or a device by its program (bridge_source.hpp),
/// as the d435i is where this was built without its library.
Result<std::unique_ptr<Source>> open_source(const std::string& name, const SourceOptions& options);

/// With the calibration that is given read: of all formats that recordings are given, where this program reads them, else
/// Kalibr's.
Result<DatasetOptions> with_calibration(DatasetOptions options);

}  // namespace fbvins::app
