// SPDX-License-Identifier: Apache-2.0
// Outliers among tracks observed in two images (paper 2.2.3): collect those to be judged, then one RANSAC over them.
// Buffers are reused; one instance, one thread. One seeded generator serves all calls, so their order matters.
//
//   EpipolarCheck check(camera.focal_px(), 1);
//   check.collect(tracks, [](const Track& t) { return t.observed ? &t.previous_normalised : nullptr; });
//   EpipolarResult result = check.judge(tracks, motion.R_ba, 0.7, stats);      // outliers are lost
#pragma once

#include <optional>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/features/epipolar_ransac.hpp"
#include "fbvins/frontend/track_table.hpp"

namespace fbvins {

class EpipolarCheck {
 public:
  EpipolarCheck(double focal_px, std::uint64_t seed) : focal_px_(focal_px), rng_(seed) {}

  /// `then(track)`: pointer to the normalised position in the earlier image; null leaves the track out.
  template <class Tracks, class Then>
  void collect(const Tracks& tracks, Then&& then) {
    chosen_.clear();
    then_.clear();
    now_.clear();
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      const Vec2* position = then(tracks[i]);
      if (position == nullptr || tracks[i].status != TrackStatus::active) continue;
      chosen_.push_back(i);
      then_.push_back(*position);
      now_.push_back(tracks[i].normalised);
    }
  }
  std::size_t gathered() const { return chosen_.size(); }

  /// Tracks farther than the threshold from the consensus' epipolar lines are lost. `R_now_then`: if it is known.
  template <class Tracks>
  EpipolarResult judge(Tracks& tracks, const std::optional<Mat3>& R_now_then, double threshold_px, FrontendStats& stats) {
    EpipolarResult result = ransac(R_now_then, threshold_px);
    for (std::size_t k = 0; k < chosen_.size(); ++k) {
      if (result.inlier[k] != 0) continue;
      tracks[chosen_[k]].status = TrackStatus::lost;
      ++stats.lost_epipolar;
    }
    return result;
  }

 private:
  EpipolarResult ransac(const std::optional<Mat3>& R_now_then, double threshold_px);

  double focal_px_;
  Rng rng_;
  std::vector<std::size_t> chosen_;  // tracks of then_ and now_
  std::vector<Vec2> then_, now_;
};

}  // namespace fbvins
