// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_track_matcher.hpp"

#include <algorithm>

namespace fbvins {
namespace {

/// Search radius when only the rotation or nothing is known.
constexpr double kSearchBlind_px = 50;
/// For a track that was not observed in the image before, whose prediction is less certain: a stricter limit.
constexpr int kReturningDistance_bits = 45;
/// Limit for descriptors as extracted, for comparison with improved ones.
constexpr int kRawDistance_bits = 60;
/// A match within this distance of the verified position of its track is an inlier.
constexpr double kInlier_px = 3;

}  // namespace

const std::vector<int>& OrbTrackMatcher::match(const OrbTracks& tracks, const OrbView& view, bool well_predicted,
                                               FrontendStats& stats) {
  queries_.clear();
  for (const OrbTrack& track : tracks) {
    GuidedQuery query;
    query.px = track.px;
    query.level = track.level;
    query.descriptor = track.descriptor;
    query.radius_px = well_predicted ? search_px_ : kSearchBlind_px;
    if (!track.was_observed) query.max_distance_bits = kReturningDistance_bits;
    queries_.push_back(query);
  }
  matcher_.match(queries_, view.features, view.grid, found_);
  collect(tracks, view, found_, matches_);
  stats.matches.found = static_cast<int>(matches_.size());
  improved_ = view.improved;
  if (improved_) match_raw(tracks, view);
  stats.raw_matches.found = static_cast<int>((improved_ ? raw_matches_ : matches_).size());
  return found_;
}

/// The same search with descriptors as extracted, for the statistics only.
void OrbTrackMatcher::match_raw(const OrbTracks& tracks, const OrbView& view) {
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    queries_[i].descriptor = tracks[i].raw;
    queries_[i].max_distance_bits = std::min(queries_[i].max_distance_bits, kRawDistance_bits);
  }
  matcher_.match(queries_, view.raw, view.grid, found_raw_);
  collect(tracks, view, found_raw_, raw_matches_);
}

void OrbTrackMatcher::collect(const OrbTracks& tracks, const OrbView& view, const std::vector<int>& found, Matches& matches) {
  matches.clear();
  for (std::size_t i = 0; i < tracks.size(); ++i)
    if (found[i] >= 0) matches.emplace_back(tracks[i].id, view.features.keypoints[static_cast<std::size_t>(found[i])].pixel);
}

int OrbTrackMatcher::inliers(const OrbTracks& tracks, const Matches& matches) {
  int count = 0;
  auto next = matches.begin();  // both are in the same order; there are tracks without a match and matches of dropped tracks
  for (const OrbTrack& track : tracks) {
    const auto match = std::find_if(next, matches.end(), [&](const auto& m) { return m.first == track.id; });
    if (match == matches.end()) continue;
    next = match + 1;
    if (track.observed && (track.px - match->second).norm() < kInlier_px) ++count;
  }
  return count;
}

void OrbTrackMatcher::count_inliers(const OrbTracks& tracks, FrontendStats& stats) const {
  stats.matches.inliers = inliers(tracks, matches_);
  stats.raw_matches.inliers = improved_ ? inliers(tracks, raw_matches_) : stats.matches.inliers;
}

}  // namespace fbvins
