// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/camera_groups.hpp"

#include <algorithm>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace {

constexpr double kDistance_m = 3;
/// Of each side of the image.
constexpr int kSamples = 16;
constexpr double kMostTurned_rad = 0.785;
constexpr double kLeastBaseline_m = 1e-3;
constexpr double kLeastOverlap = 1.0 / 3;

}  // namespace

double overlap(const StereoRig& rig, int first, int second) {
  const Camera &from = rig.camera(first), &to = rig.camera(second);
  const Pose<C0, C0> T_to_from = rig.T_BC(second).inverse() * rig.T_BC(first);
  if (T_to_from.p.norm() < kLeastBaseline_m || so3_log(T_to_from.q).norm() > kMostTurned_rad) return 0;
  int seen = 0, all = 0;
  for (int y = 0; y < kSamples; ++y)
    for (int x = 0; x < kSamples; ++x) {
      const Vec2 seen_px((x + 0.5) * from.width() / kSamples, (y + 0.5) * from.height() / kSamples);
      const auto ray = from.undistort(seen_px);
      if (!ray || from.hidden(seen_px, 0)) continue;
      ++all;
      const Vec3 p_from = kDistance_m * Vec3(ray->x(), ray->y(), 1).normalized();
      const auto px = to.project(T_to_from * p_from);
      seen += px && to.inside(*px);
    }
  return all == 0 ? 0 : static_cast<double>(seen) / all;
}

std::vector<CameraGroup> camera_groups(const StereoRig& rig) {
  std::vector<CameraGroup> groups;
  std::vector<bool> taken(static_cast<std::size_t>(rig.camera_count()), false);
  for (int first = 0; first < rig.camera_count(); ++first) {
    if (taken[static_cast<std::size_t>(first)]) continue;
    CameraGroup group{first, std::nullopt};
    double most = kLeastOverlap;
    for (int second = first + 1; second < rig.camera_count(); ++second) {
      const double share = taken[static_cast<std::size_t>(second)] ? 0 : overlap(rig, first, second);
      if (share > most) most = share, group.second = second;
    }
    if (group.second) taken[static_cast<std::size_t>(*group.second)] = true;
    groups.push_back(group);
  }
  return groups;
}

bool has_stereo(const StereoRig& rig) {
  return rig.depth || std::ranges::any_of(camera_groups(rig), [](const CameraGroup& group) { return group.second.has_value(); });
}

StereoRig rig_of(const StereoRig& rig, const CameraGroup& group) {
  std::vector<MountedCamera> cameras{rig.mounted(group.first)};
  if (group.second) cameras.push_back(rig.mounted(*group.second));
  return with_cameras(rig, cameras);
}

}  // namespace fbvins
