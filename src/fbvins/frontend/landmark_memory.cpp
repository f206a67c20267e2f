// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/landmark_memory.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

/// Longer than a landmark stays in the window.
constexpr double kWaitForPosition_s = 15;
/// Nearer to the image's edge a keypoint has no descriptor or no patch.
constexpr double kBorder_px = 16;
/// Along the camera's z; nearer landmarks are not expected.
constexpr double kNearest_m = 0.1;

}  // namespace

void LandmarkMemory::clear() {
  landmarks_.clear();
  oldest_first_.clear();
  waiting_.clear();
}

void LandmarkMemory::keep(RememberedLandmark landmark) {
  if (capacity_ == 0) return;
  const Kept kept{landmark.kept, landmark.track};
  take_out(landmark.track);
  oldest_first_.insert(kept);
  if (!landmark.p_G) waiting_.push_back(kept);
  landmarks_.emplace(kept.second, std::move(landmark));
  if (static_cast<int>(landmarks_.size()) > capacity_) take_out(oldest_first_.begin()->second);
}

void LandmarkMemory::take_out(TrackId track) {
  const auto it = landmarks_.find(track);
  if (it == landmarks_.end()) return;
  oldest_first_.erase({it->second.kept, track});
  landmarks_.erase(it);
}

void LandmarkMemory::locate(TrackId track, const Vec3& p_G) {
  const auto it = landmarks_.find(track);
  if (it != landmarks_.end()) it->second.p_G = p_G;
}

void LandmarkMemory::forget_unlocated(Time now) {
  while (!waiting_.empty() && (now - waiting_.front().first).seconds() > kWaitForPosition_s) {
    const auto [kept, track] = waiting_.front();
    waiting_.pop_front();
    const auto it = landmarks_.find(track);
    if (it != landmarks_.end() && it->second.kept == kept && !it->second.p_G) take_out(track);
  }
}

void LandmarkMemory::expect(const Pose<G, C0>& T_GC, const Camera& camera, int levels, std::vector<ExpectedLandmark>& out) const {
  out.clear();
  const Pose<C0, G> T_CG = T_GC.inverse();
  const double cos_limit = std::cos(kMaxViewAngle_rad);
  for (const auto& [track, landmark] : landmarks_) {
    if (!landmark.p_G) continue;
    const Vec3 p_C = T_CG * *landmark.p_G;
    if (p_C.z() < kNearest_m) continue;
    const Vec3 ray_now = *landmark.p_G - T_GC.p, ray_then = *landmark.p_G - landmark.seen_from_G;
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
