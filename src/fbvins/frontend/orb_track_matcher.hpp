// SPDX-License-Identifier: Apache-2.0
// Which keypoint of the newest image each track is, by its descriptor alone (paper 2.2.3): a candidate, to be checked.
// Counts, beside it, what descriptors as extracted would have found. Buffers are reused; one instance, one thread.
//
//   OrbTrackMatcher matcher(12);
//   const std::vector<int>& found = matcher.match(tracks, view, motion.has_translation, stats);   // -1: none
//   ...                                                                     // positions refined, outliers rejected
//   matcher.count_inliers(tracks, stats);
#pragma once

#include <utility>
#include <vector>

#include "fbvins/frontend/orb_matching.hpp"
#include "fbvins/frontend/orb_track.hpp"

namespace fbvins {

class OrbTrackMatcher {
 public:
  /// `search_px`: around a position predicted from the estimator's state.
  explicit OrbTrackMatcher(double search_px) : search_px_(search_px) {}

  /// The keypoint of tracks[i], or -1; valid until the next call.
  const std::vector<int>& match(const OrbTracks& tracks, const OrbView& view, bool well_predicted, FrontendStats& stats);
  /// How many of the matches lie where their track, checked, turned out to be.
  void count_inliers(const OrbTracks& tracks, FrontendStats& stats) const;

 private:
  using Matches = std::vector<std::pair<TrackId, Vec2>>;  // tracks and the keypoints found for them
  void match_raw(const OrbTracks& tracks, const OrbView& view);
  static void collect(const OrbTracks& tracks, const OrbView& view, const std::vector<int>& found, Matches& matches);
  static int inliers(const OrbTracks& tracks, const Matches& matches);

  double search_px_;
  GuidedMatcher matcher_;
  std::vector<GuidedQuery> queries_;
  std::vector<int> found_, found_raw_;
  bool improved_ = false;  // the descriptors of the newest image
  Matches matches_, raw_matches_;
};

}  // namespace fbvins
