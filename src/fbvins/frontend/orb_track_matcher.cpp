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

void OrbTrackMatcher::ask(const OrbTracks& tracks, bool well_predicted) {
  queries_.clear();
  for (const OrbTrack& track : tracks) {
    GuidedQuery query;
    query.px = track.px;
    query.level = track.level;
    query.descriptor = track.descriptor;
    query.raw = track.raw;
    query.radius_px = well_predicted ? search_px_ : kSearchBlind_px;
    if (!track.was_observed) query.max_distance_bits = kReturningDistance_bits;
    queries_.push_back(query);
  }
}

const std::vector<int>& OrbTrackMatcher::match(OrbTracks& tracks, OrbView& view, bool well_predicted, OrbImprover& improver,
                                               FrontendStats& stats) {
  improved_ = view.improves;
  if (improved_) improver.improve(tracks, view, [](const OrbTrack& track) { return !track.observed; });
  ask(tracks, well_predicted);
  if (improved_) match_raw(tracks, view);
  if (improved_ && !view.all_improved) match_improved(tracks, view, improver);
  else matcher_.match(queries_, view.comparable(), view.grid, found_);
  collect(tracks, view, found_, matches_);
  stats.matches.found = static_cast<int>(matches_.size());
  stats.raw_matches.found = static_cast<int>((improved_ ? raw_matches_ : matches_).size());
  return found_;
}

/// With descriptors as extracted: those of tracks that alignment has lost are for the statistics only.
void OrbTrackMatcher::match_raw(const OrbTracks& tracks, const OrbView& view) {
  raw_queries_ = queries_;
  for (GuidedQuery& query : raw_queries_) {
    query.descriptor = query.raw;
    query.max_distance_bits = std::min(query.max_distance_bits, kRawDistance_bits);
  }
  matcher_.match(raw_queries_, view.as_extracted(), view.grid, found_raw_);
  collect(tracks, view, found_raw_, raw_matches_);
}

/// With improved ones: those tracks. A keypoint that a track found by alignment has is not another's.
void OrbTrackMatcher::match_improved(const OrbTracks& tracks, OrbView& view, OrbImprover& improver) {
  lost_queries_.clear();
  taken_.assign(view.features.size(), 0);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (!tracks[i].observed) lost_queries_.push_back(queries_[i]);
    else if (found_raw_[i] >= 0) taken_[static_cast<std::size_t>(found_raw_[i])] = 1;
  }
  improver.improve_similar(lost_queries_, view);
  matcher_.match(lost_queries_, view.comparable(), view.grid, found_lost_);
  found_ = found_raw_;
  for (std::size_t i = 0, lost = 0; i < tracks.size(); ++i) {
    if (tracks[i].observed) continue;
    const int k = found_lost_[lost++];
    found_[i] = k >= 0 && taken_[static_cast<std::size_t>(k)] == 0 ? k : -1;
  }
}

void OrbTrackMatcher::collect(const OrbTracks& tracks, const OrbView& view, const std::vector<int>& found, Matches& matches) {
  matches.clear();
  for (std::size_t i = 0; i < tracks.size(); ++i)
    if (found[i] >= 0 && !tracks[i].observed)
      matches.emplace_back(tracks[i].id, view.features.keypoints[static_cast<std::size_t>(found[i])].pixel);
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
