// SPDX-License-Identifier: Apache-2.0
// Which keyframes share words with an image: for every word the keyframes that hold it. A query touches only the
// words of the image, so its cost grows with the keyframes per word only. Those of a file's keyframes are read from there. One
// thread at a time.
//
//   InvertedIndex index(vocabulary.words());
//   index.add(KeyframeId{0}, words);
//   for (const IndexHit& hit : index.query(words, 10)) verify(hit.keyframe);
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/loop/place_store.hpp"
#include "fbvins/loop/vocabulary.hpp"

namespace fbvins {

struct IndexHit {
  KeyframeId keyframe;
  float similarity = 0;  ///< bow_similarity of the two
};
/// The most similar ones first, equal ones in order of id; others are dropped.
void keep_best(std::vector<IndexHit>& hits, int most);

class InvertedIndex {
 public:
  explicit InvertedIndex(int words) : postings_(static_cast<std::size_t>(words)) {}

  /// Adds all keyframes of a file; before any other.
  void add(std::shared_ptr<PlaceStore> store);
  void add(KeyframeId keyframe, const BowVector& bow);
  /// `bow` does not matter for a keyframe of the file.
  void remove(KeyframeId keyframe, const BowVector& bow);
  /// The most similar ones first, equal ones in order of id. `allowed`, if given, leaves some out.
  std::vector<IndexHit> query(const BowVector& bow, int most, const std::function<bool(KeyframeId)>& allowed = {});
  /// The same among a few.
  std::vector<IndexHit> query(const BowVector& bow, int most, std::span<const KeyframeId> among);
  /// Those most similar by its rarest words alone: of so many that `most_entries` of the lists are looked at, and of
  /// `fewest_words` in any case.
  std::vector<IndexHit> shortlist(const BowVector& bow, int most, std::size_t most_entries, std::size_t fewest_words,
                                  const std::function<bool(KeyframeId)>& allowed);

  /// Entries of the lists that a query looks at.
  std::size_t entries(const BowVector& bow) const;

 private:
  struct Posting {
    std::int32_t slot;
    float weight;
  };
  std::int32_t take_slot(KeyframeId keyframe);
  std::size_t entries(std::int32_t word) const;
  void score(const BowVector& bow);
  std::vector<IndexHit> best(int most, const std::function<bool(KeyframeId)>& allowed);

  std::shared_ptr<PlaceStore> store_;  // its slots are the first ones here
  std::vector<std::vector<Posting>> postings_;
  std::unordered_map<KeyframeId, std::int32_t> slots_;  // dense numbers: ids come from files and may be huge
  std::vector<KeyframeId> keyframes_;                   // by slot
  std::vector<std::int32_t> free_;                      // slots
  std::vector<float> score_;                            // by slot, zero between queries
};

}  // namespace fbvins
