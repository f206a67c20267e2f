// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/camera_groups.hpp"

#include <algorithm>

namespace fbvins {
namespace {

constexpr double kDistance_m = 3;
/// Of each side of the image.
constexpr int kSamples = 16;
constexpr double kLeastBaseline_m = 1e-3;
constexpr double kLeastOverlap = 1.0 / 3;
/// A camera whose partner sees less of what it sees leads as well.
constexpr double kWholeOverlap = 0.7;

}  // namespace

double overlap(const StereoRig& rig, int first, int second) {
  const Camera &from = rig.camera(first), &to = rig.camera(second);
  const Pose<C0, C0> T_to_from = rig.T_BC(second).inverse() * rig.T_BC(first);
  if (T_to_from.p.norm() < kLeastBaseline_m) return 0;
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

std::vector<CameraGroup> leading_groups(const StereoRig& rig) {
  const std::vector<CameraGroup> once = camera_groups(rig);
  std::vector<CameraGroup> groups = once;
  for (const CameraGroup& group : once)
    if (group.second && overlap(rig, *group.second, group.first) < kWholeOverlap) groups.push_back({*group.second, group.first});
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
