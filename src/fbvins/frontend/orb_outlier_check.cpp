// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_outlier_check.hpp"

namespace fbvins {

void OrbOutlierCheck::judge(OrbTracks& tracks, const OrbView& view, const MotionPredictor& predictor, FrontendStats& stats) {
  for (OrbTrack& track : tracks) track.see(view.index);
  if (view.index > 0) {
    const Time before = t_[static_cast<std::size_t>(view.index - 1) % OrbTrack::kHistory];
    motion_.gather(tracks, [&](const OrbTrack& track) { return track.observed ? track.sighting(view.index - 1) : nullptr; });
    motion_.judge(tracks, predictor.between(before, view.t), (view.t - before).seconds(), stats);
  }
  for (const int lag : {1, static_cast<int>(OrbTrack::kHistory) - 1}) {
    const std::int64_t then = view.index - lag;
    if (then < 0) continue;
    const CameraMotion motion = predictor.between(t_[static_cast<std::size_t>(then) % OrbTrack::kHistory], view.t);
    std::optional<Mat3> R_now_then;
    if (motion.has_rotation) R_now_then = motion.R_ba;
    epipolar_.gather(tracks, [&](const OrbTrack& track) { return track.observed ? track.sighting(then) : nullptr; });
    (void)epipolar_.judge(tracks, R_now_then, threshold_px_, stats);
  }
}

}  // namespace fbvins
