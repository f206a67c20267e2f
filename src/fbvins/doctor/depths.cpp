// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/depths.hpp"

namespace fbvins {
namespace {

/// Where the feature was matched in the right image, from the depth that the working rig gave it.
std::optional<Vec2> right_px(const StereoRig& worked, const SeenFeature& feature) {
  const auto ray = worked.left().undistort(feature.px);
  if (!ray) return std::nullopt;
  return worked.right().project(worked.T_C1C0() * Vec3(ray->homogeneous() / feature.inverse_depth));
}

/// 0 where the rays do not meet in front of the cameras.
double inverse_depth_by(const StereoRig& rig, const Vec2& left_px, const Vec2& right_px) {
  const auto left = rig.left().undistort(left_px), right = rig.right().undistort(right_px);
  if (!left || !right) return 0;
  const Pose<C1, C0> T_C1C0 = rig.T_C1C0();
  // right x (z R left + p) = 0
  const Vec3 along = right->homogeneous().cross(T_C1C0.R() * left->homogeneous());
  const double z = -right->homogeneous().cross(T_C1C0.p).dot(along) / along.squaredNorm();
  return z > 0 ? 1 / z : 0;
}

}  // namespace

Evidence with_depths_by(const StereoRig& rig, Evidence evidence) {
  if (!rig.has_right()) return evidence;  // a depth sensor measured them
  for (SeenFrame& frame : evidence.frames)
    for (SeenFeature& feature : frame.features) {
      if (feature.inverse_depth <= 0) continue;
      const auto right = right_px(evidence.working_rig, feature);
      feature.inverse_depth = right ? inverse_depth_by(rig, feature.px, *right) : 0;
    }
  evidence.working_rig = rig;
  return evidence;
}

Evidence without(const std::set<std::int64_t>& ids, Evidence evidence) {
  for (SeenFrame& frame : evidence.frames)
    std::erase_if(frame.features, [&](const SeenFeature& f) { return ids.contains(f.id); });
  return evidence;
}

}  // namespace fbvins
