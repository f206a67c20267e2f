// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/candidate_search.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/angle.hpp"

namespace fbvins {
namespace {

/// Candidates to verify for a keyframe, out of so many of the most similar.
constexpr std::size_t kCandidates = 3;
constexpr int kMostSimilar = 40;
/// A query that would look at more entries of the index, as in maps of some ten thousand keyframes, first makes a list of so many
/// by its rarest words, of which it needs so many.
constexpr std::size_t kManyEntries = 100'000, kFewestWords = 40;
constexpr int kShortlist = 120;
/// To compare with the words of a keyframe is as much work as so many entries of the index.
constexpr std::size_t kEntriesOfAKeyframe = 1000;
/// Keyframes younger than this make no loop, nor do those that the flight only left: they are farther away than this share of the
/// way since, on which the odometry knows better (L37).
constexpr double kMinAge_s = 2, kCameBack = 0.5;
/// Keyframes that look in a direction that differs more are no candidates.
constexpr double kMaxAngle_rad = 65 * kDegree;
/// The search reaches so many standard deviations of the position farther.
constexpr double kReach_sigma = 3;
/// Keyframes this near in time show one place; where no pose is predicted, each adds this share of its similarity to that
/// of its neighbours.
constexpr double kGroup_s = 3;
constexpr float kNeighbourShare = 0.25f;

double seconds_between(const MapKeyframe& a, const MapKeyframe& b) { return std::abs((a.t - b.t).seconds()); }

/// Of one flight, which has turned around since, or moved about in one place.
bool came_back(const MapKeyframe& query, const MapKeyframe& k, double distance2_m2) {
  const double back_m = kCameBack * (query.path_m - k.path_m);
  return seconds_between(query, k) >= kMinAge_s && distance2_m2 <= back_m * back_m;
}

/// Of one flight: those of another may have the same stamps.
bool neighbours(const MapKeyframe& a, const MapKeyframe& b) { return a.session == b.session && seconds_between(a, b) < kGroup_s; }

/// Several similar neighbours support a place.
std::vector<IndexHit> supported_by_neighbours(const PlaceMap& map, const std::vector<IndexHit>& hits) {
  std::vector<IndexHit> grouped = hits;
  for (IndexHit& a : grouped)
    for (const IndexHit& b : hits)
      if (a.keyframe != b.keyframe && neighbours(*map.find(a.keyframe), *map.find(b.keyframe)))
        a.similarity += kNeighbourShare * b.similarity;
  std::stable_sort(grouped.begin(), grouped.end(),
                   [](const IndexHit& a, const IndexHit& b) { return a.similarity > b.similarity; });
  return grouped;
}

/// The most similar ones, one of each group of neighbours in time.
std::vector<KeyframeId> one_of_each_place(const PlaceMap& map, const std::vector<IndexHit>& hits) {
  std::vector<KeyframeId> chosen;
  for (const IndexHit& hit : hits) {
    if (chosen.size() == kCandidates) break;
    const MapKeyframe& k = *map.find(hit.keyframe);
    const bool covered = std::any_of(chosen.begin(), chosen.end(), [&](KeyframeId c) { return neighbours(*map.find(c), k); });
    if (!covered) chosen.push_back(hit.keyframe);
  }
  return chosen;
}

}  // namespace

std::vector<KeyframeId> CandidateSearch::plausible(const PlaceMap& map, const MapKeyframe& query, double sigma_m) const {
  const double reach = max_distance_m_ + kReach_sigma * sigma_m, min_cos = std::cos(kMaxAngle_rad);
  const auto axis_of = [&](const MapKeyframe& k) -> Vec3 { return k.T_MB.q * (map.T_BC(k).q * Vec3::UnitZ()); };
  const Vec3 axis = axis_of(query);
  std::vector<KeyframeId> ids;
  for (const MapKeyframe& k : map.keyframes()) {
    const double distance2 = (k.T_MB.p - query.T_MB.p).squaredNorm();
    if (distance2 > reach * reach || !k.placed) continue;  // the distance first: most are far
    if (k.session == query.session && !came_back(query, k, distance2)) continue;
    if (axis_of(k).dot(axis) < min_cos) continue;
    ids.push_back(k.id);
  }
  return ids;
}

/// With the words of each, or by the index, whichever is less work; the result is the same.
std::vector<IndexHit> CandidateSearch::most_similar(const PlaceMap& map, const BowVector& words,
                                                    const std::vector<KeyframeId>& among) {
  if (among.size() * kEntriesOfAKeyframe > index_.entries(words)) return index_.query(words, kMostSimilar, among);
  std::vector<IndexHit> hits;
  for (const KeyframeId id : among)
    if (const float similarity = bow_similarity(words, *map.words_of(*map.find(id))); similarity > 0)
      hits.push_back({id, similarity});
  keep_best(hits, kMostSimilar);
  return hits;
}

/// In a large map, of those that share its rarest words.
std::vector<IndexHit> CandidateSearch::most_similar(const PlaceMap& map, const BowVector& words) {
  const auto placed = [&](KeyframeId k) { return map.find(k)->placed; };
  if (index_.entries(words) <= kManyEntries) return index_.query(words, kMostSimilar, placed);
  std::vector<IndexHit> hits = index_.shortlist(words, kShortlist, kManyEntries, kFewestWords, placed);
  for (IndexHit& hit : hits) hit.similarity = bow_similarity(words, *map.words_of(*map.find(hit.keyframe)));
  keep_best(hits, kMostSimilar);
  return hits;
}

std::vector<KeyframeId> CandidateSearch::around(const PlaceMap& map, const MapKeyframe& query, double sigma_m) {
  const std::vector<KeyframeId> near = plausible(map, query, sigma_m);
  return one_of_each_place(map, most_similar(map, query.place.words, near));
}

std::vector<KeyframeId> CandidateSearch::anywhere(const PlaceMap& map, const MapKeyframe& query) {
  return one_of_each_place(map, supported_by_neighbours(map, most_similar(map, query.place.words)));
}

}  // namespace fbvins
