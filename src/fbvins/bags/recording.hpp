// SPDX-License-Identifier: Apache-2.0
// Private: third-party recordings as Datasets: ROS 1 bags (also librealsense's), ROS 2 bags (SQLite and MCAP), MCAP files of ROS
// messages, TUM-VI and EuRoC folders, flight records. Any thread, one a Dataset.
//
//   auto data = open_recording("flight.bag", {});
//   if (!data) return report(data.error().message);        // "flight.bag: has 3 image topics (/a, /b, /c): say which ..."
//   while (auto event = (*data)->next()) system.push(std::move(*event));
//
// A bag is scanned once when it is opened, its images are read when they are delivered. IMU readings and images are in the
// order of their own stamps, not of when they were recorded.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/io/dataset.hpp"

namespace fbvins {

struct RecordingOptions {
  DatasetOptions dataset = {};
  std::string calibration = {},
              imu_calibration = {};  ///< files of any known format (calibration.hpp), instead of the recording's own
  std::vector<std::string> topics =
      {};                     ///< of a bag: the cameras' in their order, the IMU's, depth images; those missing are found
  bool by_recording = false;  ///< of a bag: stamps are the times of recording
};

/// An error where the topics or the calibration cannot be found.
Result<std::unique_ptr<Dataset>> open_recording(const std::string& path, const RecordingOptions& options = {});

/// A bag of messages, by its name or content; neither a EuRoC recording nor a flight record.
bool is_bag(const std::string& path);

}  // namespace fbvins
