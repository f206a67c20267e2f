// SPDX-License-Identifier: Apache-2.0
// Which cameras of a rig see the same things, from geometry.
//
//   for (const CameraGroup& group : leading_groups(rig)) frontends.push_back(for_rig(rig_of(rig, group)));
#pragma once

#include <optional>
#include <vector>

#include "fbvins/camera/camera.hpp"

namespace fbvins {

/// Two cameras that overlap, or one that none overlaps with, by number.
struct CameraGroup {
  int first = 0;
  std::optional<int> second;
};

/// Share of what the first camera's image shows that the second one sees as well, of things three metres away; 0 where the
/// cameras are at one place: nothing can be matched to a depth.
double overlap(const StereoRig& rig, int first, int second);

/// Each camera once, in order: with the camera that it overlaps with most, of those that are left, if that is a third of its
/// image.
std::vector<CameraGroup> camera_groups(const StereoRig& rig);

/// The cameras in which features are followed, each as the first of its group: those of camera_groups, and the second one of a
/// pair whose first one does not see most of what it sees.
std::vector<CameraGroup> leading_groups(const StereoRig& rig);

/// Whether any two cameras overlap, or there is a depth sensor, so that depth is seen without motion.
bool has_stereo(const StereoRig& rig);

/// The cameras of a group as a rig of their own.
StereoRig rig_of(const StereoRig& rig, const CameraGroup& group);

}  // namespace fbvins
