// SPDX-License-Identifier: Apache-2.0
// A recording in another format, as `fbvins convert` writes it: a bag for FILE.bag, a flight record for FILE.mcap, a
// folder of rosbag2 where that is asked for, else an EuRoC folder. One thread.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/io/dataset.hpp"

namespace fbvins::app {

/// The flight record that a recording is, with its own calibration: what else is in it is kept.
struct ConvertedRecord {
  std::string path = "";  ///< empty: it is no record, or another calibration is used
  bool whole = true;      ///< false: a part of it by time
};

struct ConvertTarget {
  std::string path;
  bool rosbag2 = false;                           ///< a folder that `ros2 bag` plays
  std::map<std::string, std::string> names = {};  ///< topics that get another name
  bool half = false;                              ///< images of half the width and height; no outputs of a record
};

/// The number of stereo frames. A record written as a record is copied message by message, outputs included; in a bag its poses
/// are on /odometry, in a folder in odometry_tum.txt. An error where the target exists already, the disk is full, or a topic to
/// be renamed is not there.
Result<int> convert_recording(Dataset& data, const ConvertedRecord& record, const ConvertTarget& target,
                              const std::function<void(int frames)>& on_frame);

}  // namespace fbvins::app
