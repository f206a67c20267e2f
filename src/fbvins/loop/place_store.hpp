// SPDX-License-Identifier: Apache-2.0
// Places and words of a map file, read when they are asked for; the last ones used are kept, up to a number of bytes.
// What cannot be read, or is not what was written, is empty, and damage() says so: a flight goes on without it.
// One thread at a time, also for all maps that share a store.
//
//   std::shared_ptr<const Place> place = store.place(7);          // stays as long as it is held
//   for (const WordPosting& p : store.keyframes_with(word)) count(p.slot);
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fbvins/core/byte_source.hpp"
#include "fbvins/core/ids.hpp"
#include "fbvins/loop/last_used.hpp"
#include "fbvins/loop/place.hpp"

namespace fbvins {

/// Where a place of the file lies, and behind it its words. Its slot is its number among them.
struct StoredPlace {
  KeyframeId keyframe;
  std::uint32_t features = 0, words = 0;
  std::uint64_t at = 0, checksum = 0, words_checksum = 0;

  std::uint64_t place_bytes() const;
  std::uint64_t words_bytes() const { return words * std::uint64_t{sizeof(BowEntry)}; }
};

/// Where the keyframes that hold a word are listed.
struct StoredWord {
  std::int32_t word = 0;
  std::uint32_t keyframes = 0;
  std::uint64_t at = 0, checksum = 0;
};

/// A keyframe that holds a word, and its weight there.
struct WordPosting {
  std::uint32_t slot = 0;
  float weight = 0;
};

class PlaceStore {
 public:
  /// `words` in order; `name` is for messages. The last place and the last words are kept whatever `most_bytes` says.
  PlaceStore(std::string name, std::shared_ptr<ByteSource> file, std::vector<StoredPlace> places, std::vector<StoredWord> words,
             std::uint64_t most_bytes);

  std::size_t size() const { return places_.size(); }
  const StoredPlace& at(std::size_t slot) const { return places_[slot]; }
  const std::vector<StoredWord>& words() const { return words_; }

  /// Without words; vertical and focal length are not in it. Never null.
  std::shared_ptr<Place> place(std::size_t slot);
  /// Never null.
  std::shared_ptr<const BowVector> words_of(std::size_t slot);
  /// Place and words as they are in the file; checked.
  Result<std::string> bytes_of(std::size_t slot) const;
  /// Null where no keyframe holds it.
  const StoredWord* find(std::int32_t word) const;
  /// In order of slots. Until the next call.
  std::span<const WordPosting> keyframes_with(const StoredWord& word);

  /// The first that was found.
  const std::optional<Error>& damage() const { return damage_; }
  /// Of what is kept.
  std::uint64_t held_bytes() const { return places_held_.bytes() + words_held_.bytes(); }

 private:
  Result<Place> read_place(std::size_t slot) const;
  Result<BowVector> read_words(std::size_t slot) const;
  Error as_written(std::size_t slot) const;
  void note(Error error);

  std::string name_;
  std::shared_ptr<ByteSource> file_;
  std::vector<StoredPlace> places_;
  std::vector<StoredWord> words_;
  LastUsed<Place> places_held_;
  LastUsed<BowVector> words_held_;
  std::string buffer_;
  std::vector<WordPosting> postings_;
  std::optional<Error> damage_;
};

}  // namespace fbvins
