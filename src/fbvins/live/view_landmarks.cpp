// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/view_landmarks.hpp"

#include <array>
#include <limits>
#include <unordered_map>

namespace fbvins {

std::vector<RosLandmark> landmarks_of(const LiveView& view) {
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  std::vector<RosLandmark> out;
  std::unordered_map<TrackId, std::size_t> places;
  for (const LiveView::Feature& f : view.features) {
    places.emplace(f.track, out.size());
    out.push_back({static_cast<std::uint32_t>(f.track.value),
                   {kUnknown, kUnknown, kUnknown},
                   f.camera == 0 ? std::array{static_cast<float>(f.pixel.x()), static_cast<float>(f.pixel.y())}
                                 : std::array{kUnknown, kUnknown},
                   static_cast<float>(f.age_frames),
                   static_cast<float>(f.depth_m)});
  }
  for (const LiveView::Landmark& l : view.landmarks) {
    const auto [place, is_new] = places.emplace(l.track, out.size());
    if (is_new) out.push_back({static_cast<std::uint32_t>(l.track.value), {}, {kUnknown, kUnknown}, kUnknown, kUnknown});
    const Eigen::Vector3f p = l.p_W.cast<float>();
    out[place->second].p_W = {p.x(), p.y(), p.z()};
  }
  return out;
}

}  // namespace fbvins
