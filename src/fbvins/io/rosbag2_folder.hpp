// SPDX-License-Identifier: Apache-2.0
// Private: an MCAP file of ROS 2's messages as a folder that `ros2 bag` plays: the file, and metadata.yaml beside it. One thread.
//
//   Result<RecoveredMcap> done = write_rosbag2("flight.mcap", "flight", {.names = {{"/camera/left", "/cam0/image_raw"}}});
#pragma once

#include <string>

#include "fbvins/io/mcap_recover.hpp"

namespace fbvins {

/// `out` becomes a folder with NAME_0.mcap and metadata.yaml (version 5, as of Humble). An error as of recover_mcap().
Result<RecoveredMcap> write_rosbag2(const std::string& in, const std::string& out, const McapPart& part = {});

}  // namespace fbvins
