// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "fbvins/loop/map_records.hpp"

namespace fbvins {
namespace {

/// Of the memory, for words: those of seven keyframes take as much as the features of one.
constexpr std::uint64_t kShareOfWords = 4;

bool is_whole(std::string_view bytes, std::uint64_t expected, std::uint64_t checksum) {
  return bytes.size() == expected && map_checksum(bytes) == checksum;
}

}  // namespace

std::uint64_t StoredPlace::place_bytes() const { return features * std::uint64_t{kFeatureBytes}; }

PlaceStore::PlaceStore(std::string name, std::shared_ptr<ByteSource> file, std::vector<StoredPlace> places,
                       std::vector<StoredWord> words, std::uint64_t most_bytes)
    : name_(std::move(name)),
      file_(std::move(file)),
      places_(std::move(places)),
      words_(std::move(words)),
      places_held_(most_bytes - most_bytes / kShareOfWords),
      words_held_(most_bytes / kShareOfWords) {}

void PlaceStore::note(Error error) {
  if (!damage_) damage_ = std::move(error);
}

Error PlaceStore::as_written(std::size_t slot) const {
  return damaged_map(name_, fmt::format("keyframe {} is not as it was written", places_[slot].keyframe.value));
}

Result<std::string> PlaceStore::bytes_of(std::size_t slot) const {
  const StoredPlace& p = places_[slot];
  std::string bytes = file_->read(p.at, p.place_bytes() + p.words_bytes());
  const std::string_view place = std::string_view(bytes).substr(0, p.place_bytes()),
                         words = std::string_view(bytes).substr(place.size());
  if (!is_whole(place, p.place_bytes(), p.checksum) || !is_whole(words, p.words_bytes(), p.words_checksum))
    return as_written(slot);
  return bytes;
}

Result<Place> PlaceStore::read_place(std::size_t slot) const {
  const StoredPlace& p = places_[slot];
  const std::string bytes = file_->read(p.at, p.place_bytes());
  if (!is_whole(bytes, p.place_bytes(), p.checksum)) return as_written(slot);
  BytesIn in(bytes);
  Place place;
  get_place(in, p.features, place);
  if (!in.ok()) return damaged_map(name_, fmt::format("keyframe {} makes no sense", p.keyframe.value));
  return place;
}

Result<BowVector> PlaceStore::read_words(std::size_t slot) const {
  const StoredPlace& p = places_[slot];
  const std::string bytes = file_->read(p.at + p.place_bytes(), p.words_bytes());
  if (!is_whole(bytes, p.words_bytes(), p.words_checksum)) return as_written(slot);
  BytesIn in(bytes);
  BowVector words;
  get_words(in, p.words, words);
  if (!in.ok()) return damaged_map(name_, fmt::format("the words of keyframe {} make no sense", p.keyframe.value));
  return words;
}

std::shared_ptr<Place> PlaceStore::place(std::size_t slot) {
  if (std::shared_ptr<Place> known = places_held_.find(slot)) return known;
  Result<Place> place = read_place(slot);
  if (!place) note(place.error());
  const std::uint64_t bytes = place ? places_[slot].place_bytes() : 0;
  return places_held_.keep(slot, place ? *std::move(place) : Place{}, bytes);
}

std::shared_ptr<const BowVector> PlaceStore::words_of(std::size_t slot) {
  if (std::shared_ptr<BowVector> known = words_held_.find(slot)) return known;
  Result<BowVector> words = read_words(slot);
  if (!words) note(words.error());
  const std::uint64_t bytes = words ? places_[slot].words_bytes() : 0;
  return words_held_.keep(slot, words ? *std::move(words) : BowVector{}, bytes);
}

const StoredWord* PlaceStore::find(std::int32_t word) const {
  const auto at = std::ranges::lower_bound(words_, word, {}, &StoredWord::word);
  return at != words_.end() && at->word == word ? &*at : nullptr;
}

std::span<const WordPosting> PlaceStore::keyframes_with(const StoredWord& word) {
  const std::uint64_t count = word.keyframes * std::uint64_t{sizeof(WordPosting)};
  file_->fill(buffer_, word.at, count);
  postings_.clear();
  const bool whole = is_whole(buffer_, count, word.checksum);
  if (whole) {
    postings_.resize(word.keyframes);
    std::memcpy(postings_.data(), buffer_.data(), buffer_.size());
  }
  std::int64_t last = -1;
  bool good = whole;
  for (const WordPosting& p : postings_) {
    good = good && p.slot > last && p.slot < places_.size() && std::isfinite(p.weight) && p.weight >= 0;
    last = p.slot;
  }
  if (!good) {
    postings_.clear();
    note(damaged_map(name_, fmt::format("the keyframes with word {} {}", word.word,
                                        whole ? "make no sense" : "are not as they were written")));
  }
  return postings_;
}

}  // namespace fbvins
