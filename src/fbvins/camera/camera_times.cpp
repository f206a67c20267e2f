// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/camera_times.hpp"

namespace fbvins {

StereoRig with_times(StereoRig rig, const std::vector<CameraTimes>& times) {
  const CameraTimes& first = times.front();
  std::vector<MountedCamera> cameras;
  for (int i = 0; i < rig.camera_count(); ++i) {
    const CameraTimes& own = times[static_cast<std::size_t>(i)];
    cameras.push_back(rig.mounted(i));
    cameras.back().camera.set_own_times({own.time_offset_s - first.time_offset_s, own.line_delay_s - first.line_delay_s});
  }
  rig = with_cameras(std::move(rig), std::move(cameras));
  rig.time_offset_s = first.time_offset_s;
  rig.line_delay_s = first.line_delay_s;
  return rig;
}

ExposureOffsets own_offsets(const StereoRig& rig) {
  ExposureOffsets out;
  for (int i = 0; i < rig.camera_count(); ++i)
    if (const double more_s = rig.camera(i).own_times().time_offset_s; more_s != 0) out.set(i, Duration::from_seconds(more_s));
  return out;
}

bool has_rolling_shutter(const StereoRig& rig) {
  for (int i = 0; i < rig.camera_count(); ++i)
    if (rig.times(i).line_delay_s != 0) return true;
  return false;
}

}  // namespace fbvins
