// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/landmark_memory.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

/// Longer than any window lasts.
constexpr double kWaitForPosition_s = 15;
/// Nearer to the image's edge a keypoint has no descriptor or no patch.
constexpr double kBorder_px = 16;
/// Along the camera's z; what is nearer or behind is not seen.
constexpr double kNearest_m = 0.1;

}  // namespace

void LandmarkMemory::clear() { landmarks_.clear(); }

void LandmarkMemory::keep(RememberedLandmark landmark) {
  if (capacity_ == 0) return;
  const TrackId track = landmark.track;
  landmarks_.insert_or_assign(track, std::move(landmark));
  if (static_cast<int>(landmarks_.size()) <= capacity_) return;
  landmarks_.erase(std::min_element(landmarks_.begin(), landmarks_.end(),
                                    [](const auto& a, const auto& b) { return a.second.kept < b.second.kept; }));
}

void LandmarkMemory::locate(TrackId track, const Vec3& p_W) {
  const auto it = landmarks_.find(track);
  if (it != landmarks_.end()) it->second.p_W = p_W;
}

void LandmarkMemory::forget_unlocated(Time now) {
  std::erase_if(landmarks_,
                [&](const auto& entry) { return !entry.second.p_W && (now - entry.second.kept).seconds() > kWaitForPosition_s; });
}

void LandmarkMemory::expect(const Pose<W, C0>& T_WC, const Camera& camera, int levels, std::vector<ExpectedLandmark>& out) const {
  out.clear();
  const Pose<C0, W> T_CW = T_WC.inverse();
  const double cos_limit = std::cos(kMaxViewAngle_rad);
  for (const auto& [track, landmark] : landmarks_) {
    if (!landmark.p_W) continue;
    const Vec3 p_C = T_CW * *landmark.p_W;
    if (p_C.z() < kNearest_m) continue;
    const Vec3 ray_now = *landmark.p_W - T_WC.p, ray_then = *landmark.p_W - landmark.seen_from_W;
    const double now = ray_now.norm(), then = ray_then.norm(), scale = then / now;
    if (scale < kSmallestViewScale || scale * kSmallestViewScale > 1) continue;
    if (ray_now.dot(ray_then) < cos_limit * now * then) continue;
    const auto px = camera.project(p_C);
    if (!px || !camera.inside(*px, kBorder_px)) continue;
    const int level = landmark.level + static_cast<int>(std::lround(std::log(scale) / std::log(kOrbScaleFactor)));
    out.push_back({&landmark, *px, p_C.hnormalized(), std::clamp(level, 0, levels - 1), p_C.z()});
  }
}

}  // namespace fbvins
