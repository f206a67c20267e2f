// SPDX-License-Identifier: Apache-2.0
#include "apps/open_recording.hpp"
#include "fbvins/bags/bag_poses.hpp"
#include "fbvins/bags/recording.hpp"

namespace fbvins::app {

Result<std::unique_ptr<Dataset>> open_recording(const RecordingArguments& arguments, const DatasetOptions& options) {
  const auto topic = [&](std::size_t i) { return i < arguments.topics.size() ? arguments.topics[i] : std::string(); };
  DatasetOptions with = options;
  with.start_s = arguments.start_s;
  with.duration_s = arguments.duration_s;
  return fbvins::open_recording(arguments.path,
                                {with, arguments.calibration, arguments.imu_calibration, topic(0), topic(1), topic(2)});
}

Result<Trajectory<W>> open_poses(const std::string& path, const std::string& topic) {
  if (is_bag(path)) return read_bag_poses(path, topic);
  return read_pose_file(path);
}

bool is_for_bags(int, char**) { return false; }

}  // namespace fbvins::app
