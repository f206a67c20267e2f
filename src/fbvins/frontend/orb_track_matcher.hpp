// SPDX-License-Identifier: Apache-2.0
// Matches each track with a keypoint of the newest image by its descriptor (paper 2.2.3): a candidate, to be verified.
// Where descriptors are improved, they serve to find tracks that alignment has lost. A track that it follows is only to get the
// keypoint at its position, for which the descriptor as extracted is good enough and need not be improved.
// For the statistics also counts matches of descriptors as extracted. Buffers are reused; one instance, one thread.
//
//   OrbTrackMatcher matcher(12);
//   const std::vector<int>& found = matcher.match(tracks, view, motion.has_translation, improver, stats);   // -1: none
//   ...                                                                     // positions refined, outliers rejected
//   matcher.count_inliers(tracks, stats);
#pragma once

#include <utility>
#include <vector>

#include "fbvins/frontend/orb_improver.hpp"

namespace fbvins {

class OrbTrackMatcher {
 public:
  /// `search_px`: radius around a position predicted from the estimator's state.
  explicit OrbTrackMatcher(double search_px) : search_px_(search_px) {}

  /// The keypoint of tracks[i], or -1; valid until the next call.
  const std::vector<int>& match(OrbTracks& tracks, OrbView& view, bool well_predicted, OrbImprover& improver,
                                FrontendStats& stats);
  /// Counts the matches that agree with the verified positions of their tracks.
  void count_inliers(const OrbTracks& tracks, FrontendStats& stats) const;

 private:
  using Matches = std::vector<std::pair<TrackId, Vec2>>;  // tracks and the keypoints found for them
  void ask(const OrbTracks& tracks, bool well_predicted);
  void match_raw(const OrbTracks& tracks, const OrbView& view);
  void match_improved(const OrbTracks& tracks, OrbView& view, OrbImprover& improver);
  static void collect(const OrbTracks& tracks, const OrbView& view, const std::vector<int>& found, Matches& matches);
  static int inliers(const OrbTracks& tracks, const Matches& matches);

  double search_px_;
  GuidedMatcher matcher_;
  std::vector<GuidedQuery> queries_, raw_queries_, lost_queries_;
  std::vector<int> found_, found_raw_, found_lost_;
  std::vector<std::uint8_t> taken_;  // for each keypoint, whether a track that alignment follows has it
  bool improved_ = false;            // whether the newest image's descriptors are
  Matches matches_, raw_matches_;
};

}  // namespace fbvins
