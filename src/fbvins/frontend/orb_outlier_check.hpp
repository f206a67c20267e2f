// SPDX-License-Identifier: Apache-2.0
// Outliers among the observed tracks (paper 2.2.3): on moving objects (motion_check.hpp), then by the epipolar constraint against
// the image before and against one five images back: a false corner, where edges at different depths cross, slides by less than
// the noise from image to image, but by more over several. One instance, one thread.
//
//   OrbOutlierCheck check(camera, baseline_m, 1.0);
//   check.begin(view);                                   // every image, also one without tracks
//   check.judge(tracks, view, predictor, stats);         // outliers are lost
#pragma once

#include <array>

#include "fbvins/frontend/epipolar_check.hpp"
#include "fbvins/frontend/motion_check.hpp"
#include "fbvins/frontend/orb_track.hpp"

namespace fbvins {

class OrbOutlierCheck {
 public:
  OrbOutlierCheck(const Camera& camera, double baseline_m, double threshold_px)
      : threshold_px_(threshold_px), motion_(camera, baseline_m), epipolar_(camera.focal_px(), kSeed) {}

  void begin(const OrbView& view) { t_[static_cast<std::size_t>(view.index) % OrbTrack::kHistory] = view.t; }
  /// Also stores the tracks' positions in this image.
  void judge(OrbTracks& tracks, const OrbView& view, const MotionPredictor& predictor, FrontendStats& stats);

 private:
  static constexpr std::uint64_t kSeed = 2;

  double threshold_px_;
  MotionCheck motion_;
  EpipolarCheck epipolar_;
  std::array<Time, OrbTrack::kHistory> t_;  // of image i at i % kHistory
};

}  // namespace fbvins
