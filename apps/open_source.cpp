// SPDX-License-Identifier: Apache-2.0
#include "apps/open_source.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "apps/bridge_source.hpp"
#include "fbvins/live/replay_source.hpp"
#include "fbvins/v4l2/v4l2_source.hpp"
#ifdef FBVINS_WITH_BAGS
#include "fbvins/bags/calibration.hpp"
#include "fbvins/bags/recording.hpp"
#endif
#ifdef FBVINS_WITH_REALSENSE
#include "fbvins/realsense/realsense_source.hpp"
#endif

namespace fbvins::app {
namespace {

template <class T>
Result<std::unique_ptr<Source>> as_source(Result<std::unique_ptr<T>> source) {
  if (!source) return source.error();
  return std::unique_ptr<Source>(*std::move(source));
}

#ifdef FBVINS_WITH_BAGS
/// Recordings and calibrations of all formats.
Result<std::unique_ptr<Dataset>> open_any(const std::string& path, const DatasetOptions& dataset) {
  RecordingOptions options{.dataset = dataset, .calibration = dataset.kalibr_camchain, .imu_calibration = dataset.kalibr_imu};
  options.dataset.kalibr_camchain = options.dataset.kalibr_imu = "";
  options.dataset.rig.reset();
  return open_recording(path, options);
}
#endif

}  // namespace

Result<DatasetOptions> with_calibration(DatasetOptions options) {
#ifdef FBVINS_WITH_BAGS
  if (options.kalibr_camchain.empty() || is_kalibr(options.kalibr_camchain)) return options;
  const Result<StereoRig> rig = load_calibration(options.kalibr_camchain, options.kalibr_imu);
  if (!rig) return rig.error();
  options.rig = *rig;
#endif
  return options;
}

Result<std::unique_ptr<Source>> open_source(const std::string& name, const SourceOptions& options) {
  const auto colon = name.find(':');
  const std::string kind = name.substr(0, colon), where = colon == std::string::npos ? "" : name.substr(colon + 1);
  // A file that is not there is said before anything that its reader needs.
  const bool of_realsense = kind == "d435i" || kind == "realsense";
  if (const auto end = where.find(".bag"); of_realsense && end != std::string::npos)
    if (const std::string file = where.substr(0, end + 4); !std::filesystem::exists(file))
      return Error{ErrorCode::not_found, fmt::format("{}: no such file", file)};
#ifdef FBVINS_WITH_REALSENSE
  if (kind == "d435i" || kind == "realsense") return as_source(RealsenseSource::open(where, options));
#endif
  if (is_bridged(kind)) return open_bridged(kind, where, options);
  if (kind == "v4l2") return as_source(V4l2Source::open(where, options));
#ifdef FBVINS_WITH_BAGS
  if (kind == "replay" && !where.empty())
    return as_source(ReplaySource::open(
        where, {.dataset = options.dataset, .laps = options.laps, .preload = options.preload, .open_file = open_any}));
#endif
  if (kind != "replay" && kind != "socket")
    return Error{
        ErrorCode::invalid_argument,
        fmt::format("source '{}': it is replay:DATASET[@SPEED], socket:PATH, ros2:TOPICS, v4l2:DEVICES, d435i, oak, orbbec or "
                    "zed:WIDTHxHEIGHT (fbvins live --help)",
                    name)};
  return make_source(name, options);
}

}  // namespace fbvins::app
