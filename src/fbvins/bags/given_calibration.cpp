// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/given_calibration.hpp"

#include <filesystem>

#include "fbvins/bags/bag_reader.hpp"
#include "fbvins/bags/calibration.hpp"
#include "fbvins/io/kalibr_imu.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;

}  // namespace

/// TUM-VI (vision.in.tum.de/data/datasets/visual-inertial-dataset): an EuRoC folder whose calibration is Kalibr's, in dso/.
void find_tum_vi(const fs::path& folder, RecordingOptions& options) {
  std::error_code ignored;
  if (!options.calibration.empty() || fs::exists(folder / "mav0/cam0/sensor.yaml", ignored)) return;
  for (const char* name : {"dso/camchain.yaml", "dso/camchain-imucam.yaml"})
    if (fs::exists(folder / name, ignored)) options.calibration = (folder / name).string();
  if (!options.calibration.empty() && options.imu_calibration.empty() && fs::exists(folder / "dso/imu_config.yaml", ignored))
    options.imu_calibration = (folder / "dso/imu_config.yaml").string();
}

/// Of several IMUs in the file that one whose topic is used: by --topics, or as the bag has it alone.
void choose_imu(const std::string& path, RecordingOptions& options) {
  std::string& file = options.imu_calibration;
  if (topics_of_imus(file).empty()) return;
  std::vector<std::string> recorded = options.topics;
  if (const auto bag = open_bag(path); bag && imu_of_topics(file, recorded) == file) {
    (*bag)->only({}, {5'000'000'000});
    while ((*bag)->next()) continue;
    for (const BagTopic& topic : (*bag)->topics())
      if (topic.type == "sensor_msgs/Imu") recorded.push_back(topic.name);
  }
  file = imu_of_topics(file, recorded);
}

/// Puts the calibration that is given with a recording into its options. Kalibr's is left to the recording's reader, which has
/// noise figures to go with it.
Result<void> take_calibration(bool bag, RecordingOptions& options) {
  if (options.calibration.empty()) {
    options.dataset.kalibr_imu = options.imu_calibration;  // with the recording's own cameras
    return {};
  }
  if (bag && is_camera_info(options.calibration)) {  // with the places that the bag has
    options.dataset.kalibr_imu = options.imu_calibration;
    return {};
  }
  const Result<StereoRig> rig = load_calibration(options.calibration, options.imu_calibration);
  if (!rig) return rig.error();
  if (bag || !is_kalibr(options.calibration)) return options.dataset.rig = *rig, Result<void>{};
  options.dataset.kalibr_camchain = options.calibration;
  options.dataset.kalibr_imu = options.imu_calibration;
  return {};
}

}  // namespace fbvins
