// SPDX-License-Identifier: Apache-2.0
#include "apps/open_source.hpp"

#include <fmt/format.h>

#include <optional>
#include <string>

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

Result<std::unique_ptr<Source>> open_realsense([[maybe_unused]] const std::string& which,
                                               [[maybe_unused]] const SourceOptions& options) {
#ifdef FBVINS_WITH_REALSENSE
  return as_source(RealsenseSource::open(which, options));
#else
  return Error{
      ErrorCode::invalid_argument,
      "this program was built without librealsense2, which the source d435i needs: `pip install pyrealsense2 numpy`, run "
      "`python3 examples/d435i_bridge.py /tmp/fbvins.sock`, and give --source socket:/tmp/fbvins.sock (docs/d435i.md)"};
#endif
}

/// Devices that a program of their maker's language reads; none where it is another word.
std::optional<Error> by_a_bridge(const std::string& kind) {
  struct Bridge {
    const char *kind, *packages, *script;
  };
  constexpr Bridge kBridges[] = {{"oak", "depthai numpy", "oak_bridge.py"},
                                 {"orbbec", "pyorbbecsdk2 numpy", "orbbec_bridge.py"},
                                 {"realsense", "pyrealsense2 numpy", "d435i_bridge.py"}};
  for (const Bridge& bridge : kBridges)
    if (kind == bridge.kind)
      return Error{ErrorCode::invalid_argument,
                   fmt::format("source '{}': its program sends what the device gives: `pip install {}`, run `python3 examples/{} "
                               "/tmp/fbvins.sock`, and give --source socket:/tmp/fbvins.sock (docs/devices.md)",
                               kind, bridge.packages, bridge.script)};
  return std::nullopt;
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
  if (kind == "d435i") return open_realsense(where, options);
  if (auto bridge = by_a_bridge(kind)) return *bridge;
  if (kind == "v4l2") return as_source(V4l2Source::open(where, options));
#ifdef FBVINS_WITH_BAGS
  if (kind == "replay" && !where.empty())
    return as_source(ReplaySource::open(
        where, {.dataset = options.dataset, .laps = options.laps, .preload = options.preload, .open_file = open_any}));
#endif
  return make_source(name, options);
}

}  // namespace fbvins::app
