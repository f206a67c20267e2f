// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_outlier_check.hpp"

namespace fbvins {

void OrbOutlierCheck::judge(OrbTracks& tracks, const OrbView& view, const MotionPredictor& predictor, FrontendStats& stats) {
  for (OrbTrack& track : tracks) track.see(view.index);
  for (const int lag : {1, static_cast<int>(OrbTrack::kHistory) - 1}) {
    const std::int64_t then = view.index - lag;
    if (then < 0) continue;
    const Time t_then = t_[static_cast<std::size_t>(then) % OrbTrack::kHistory];
    const CameraMotion motion = predictor.between(t_then, view.t);
    const auto seen_then = [&](const OrbTrack& track) { return track.observed ? track.position_in(then) : nullptr; };
    if (lag == 1) {
      motion_.collect(tracks, seen_then);
      motion_.judge(tracks, motion, (view.t - t_then).seconds(), stats);
    }
    std::optional<Mat3> R_now_then;
    if (motion.has_rotation) R_now_then = motion.R_ba;
    epipolar_.collect(tracks, seen_then);
    (void)epipolar_.judge(tracks, R_now_then, threshold_px_, stats);
  }
}

}  // namespace fbvins
