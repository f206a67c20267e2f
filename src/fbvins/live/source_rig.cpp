// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/source_rig.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "fbvins/io/kalibr.hpp"

namespace fbvins {
namespace {

/// Cameras that are missing are like the last one.
StereoRig with_camera_count(const StereoRig& rig, int cameras) {
  std::vector<MountedCamera> mounted;
  for (int i = 0; i < cameras; ++i) {
    mounted.push_back(rig.mounted(std::min(i, rig.camera_count() - 1)));
    if (i >= rig.camera_count()) mounted.back().T_BC.p.x() += 0.1 * (i - rig.camera_count() + 1);
  }
  return with_cameras(rig, mounted);
}

}  // namespace

Result<StereoRig> given_rig(const DatasetOptions& dataset) {
  if (dataset.rig) return *dataset.rig;
  return load_kalibr(dataset.kalibr_camchain, dataset.kalibr_imu.empty() ? std::nullopt : std::optional(dataset.kalibr_imu));
}

Result<StereoRig> rig_for_source(const SourceOptions& options, std::string_view what, int cameras) {
  const std::string& chain = options.dataset.kalibr_camchain;
  const std::string name = chain.empty() ? "the calibration" : chain;
  const bool given = options.dataset.brings_rig();
  if (!given && options.uncalibrated)
    return cameras == 0 ? *options.uncalibrated : with_camera_count(*options.uncalibrated, cameras);
  if (!given)
    return Error{ErrorCode::invalid_argument,
                 fmt::format("{} need --calibration: a Kalibr camchain of the cameras and the IMU", what)};
  Result<StereoRig> rig = given_rig(options.dataset);
  if (!rig || cameras == 0 || rig->camera_count() == cameras) return rig;
  return Error{ErrorCode::invalid_argument, fmt::format("{}: has {} camera{}, and there are {} {}", name, rig->camera_count(),
                                                        rig->camera_count() == 1 ? "" : "s", cameras, what)};
}

Result<StereoRig> depth_rig_for_source(const SourceOptions& options, std::string_view what) {
  const std::string& chain = options.dataset.kalibr_camchain;
  const Result<StereoRig> rig = rig_for_source(options, what, options.dataset.brings_rig() ? 0 : 1);
  if (!rig) return rig;
  if (rig->camera_count() > 2)
    return Error{ErrorCode::invalid_argument,
                 fmt::format("{}: has {} cameras, and there are one and a depth sensor", chain, rig->camera_count())};
  DepthSensor sensor;
  if (rig->has_right()) sensor.own = rig->mounted(1);
  return with_depth(*rig, sensor);
}

}  // namespace fbvins
