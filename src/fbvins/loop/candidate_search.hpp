// SPDX-License-Identifier: Apache-2.0
// Candidates of the map for the place of a new keyframe: those most similar by words, one of each place. One thread
// at a time.
//
//   CandidateSearch search(vocabulary.words(), 4.0);
//   search.add(id, place.words);
//   for (KeyframeId id : search.around(map, query, sigma_m)) verify(id);   // W is known in M
//   for (KeyframeId id : search.anywhere(map, query)) verify(id);          // it is not
#pragma once

#include <vector>

#include "fbvins/loop/inverted_index.hpp"
#include "fbvins/loop/place_map.hpp"

namespace fbvins {

class CandidateSearch {
 public:
  CandidateSearch(int words, double max_distance_m) : index_(words), max_distance_m_(max_distance_m) {}

  /// All keyframes of a file; before any other.
  void add(std::shared_ptr<PlaceStore> store) { index_.add(std::move(store)); }
  void add(KeyframeId id, const BowVector& words) { index_.add(id, words); }
  void remove(KeyframeId id, const BowVector& words) { index_.remove(id, words); }

  /// Among keyframes near `query.T_MB`, whose position has the standard deviation `sigma_m`, whose cameras look in a similar
  /// direction as that of `query`, which is one of the map's.
  std::vector<KeyframeId> around(const PlaceMap& map, const MapKeyframe& query, double sigma_m);
  /// Among all that have a place in M.
  std::vector<KeyframeId> anywhere(const PlaceMap& map, const MapKeyframe& query);

 private:
  std::vector<KeyframeId> plausible(const PlaceMap& map, const MapKeyframe& query, double sigma_m) const;
  std::vector<IndexHit> most_similar(const PlaceMap& map, const BowVector& words);
  std::vector<IndexHit> most_similar(const PlaceMap& map, const BowVector& words, const std::vector<KeyframeId>& among);

  InvertedIndex index_;
  double max_distance_m_;
};

}  // namespace fbvins
