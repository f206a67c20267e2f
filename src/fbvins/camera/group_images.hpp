// SPDX-License-Identifier: Apache-2.0
// Private: the images of a group of cameras (camera_groups.hpp). Pure function.
#pragma once

#include "fbvins/camera/camera_groups.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// As left and, where there is a second camera, right, with their offsets from the frame's stamp: a frame of rig_of(rig, group).
inline StereoFrame images_of(const StereoFrame& frame, const CameraGroup& group) {
  StereoFrame out{frame.t, {frame.image(group.first)}};
  out.offsets.set(0, frame.offsets.of(group.first));
  if (!group.second) return out;
  out.images.push_back(frame.image(*group.second));
  out.offsets.set(1, frame.offsets.of(*group.second));
  return out;
}

}  // namespace fbvins
