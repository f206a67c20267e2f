// SPDX-License-Identifier: Apache-2.0
// Places and words of a map file, read when they are asked for; of places the last ones used are kept, up to a number of bytes.
// What cannot be read, or is not what was written, is empty, and damage() says so: a flight goes on without it.
// One thread at a time, also for all maps that share a store.
//
//   std::shared_ptr<const Place> place = store.place(7);          // stays as long as it is held
//   for (const WordPosting& p : store.postings(word)) count(p.slot);
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "fbvins/core/byte_source.hpp"
#include "fbvins/core/ids.hpp"
#include "fbvins/loop/place.hpp"

namespace fbvins {

/// Where the places of a file lie. Its slot is its number among them.
struct StoredPlace {
  KeyframeId keyframe;
  std::uint32_t features = 0;
  std::uint64_t at = 0, checksum = 0;
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
  /// `words` in order; `name` is for messages. The last place that was used is kept whatever `most_bytes` says.
  PlaceStore(std::string name, std::shared_ptr<ByteSource> file, std::vector<StoredPlace> places, std::vector<StoredWord> words,
             std::uint64_t most_bytes);

  std::size_t size() const { return places_.size(); }
  const StoredPlace& at(std::size_t slot) const { return places_[slot]; }
  const std::vector<StoredWord>& words() const { return words_; }

  /// Without words; vertical and focal length are not in it. Never null.
  std::shared_ptr<Place> place(std::size_t slot);
  /// As they are in the file; checked.
  Result<std::string> bytes_of(std::size_t slot) const;
  /// In order of slots. Until the next call.
  std::span<const WordPosting> postings(std::int32_t word);
  std::span<const WordPosting> postings(const StoredWord& word);

  /// The first that was found.
  const std::optional<Error>& damage() const { return damage_; }
  /// Of the places that are kept.
  std::uint64_t held_bytes() const { return held_bytes_; }

 private:
  struct Held {
    std::size_t slot;
    std::shared_ptr<Place> place;
    std::uint64_t bytes;
  };
  Result<Place> read(std::size_t slot) const;
  void note(Error error);

  std::string name_;
  std::shared_ptr<ByteSource> file_;
  std::vector<StoredPlace> places_;
  std::vector<StoredWord> words_;
  std::uint64_t most_bytes_, held_bytes_ = 0;
  std::list<Held> held_;  ///< the last used first
  std::unordered_map<std::size_t, std::list<Held>::iterator> by_slot_;
  std::string buffer_;
  std::vector<WordPosting> postings_;
  std::optional<Error> damage_;
};

}  // namespace fbvins
