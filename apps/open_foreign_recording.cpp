// SPDX-License-Identifier: Apache-2.0
#include "apps/open_recording.hpp"
#include "fbvins/bags/recording.hpp"

namespace fbvins::app {

Result<std::unique_ptr<Dataset>> open_recording(const RecordingArguments& arguments, const DatasetOptions& options) {
  const auto topic = [&](std::size_t i) { return i < arguments.topics.size() ? arguments.topics[i] : std::string(); };
  return fbvins::open_recording(arguments.path,
                                {options, arguments.calibration, arguments.imu_calibration, topic(0), topic(1), topic(2)});
}

bool is_for_bags(int, char**) { return false; }

}  // namespace fbvins::app
