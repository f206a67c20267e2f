// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "fbvins/loop/binary_file.hpp"
#include "fbvins/loop/map_records.hpp"

namespace fbvins {
namespace {

/// A place in memory beside its features and descriptors: vectors, list and table.
constexpr std::uint64_t kOverhead_bytes = 256;

bool is_whole(const std::string& bytes, std::uint64_t expected, std::uint64_t checksum) {
  return bytes.size() == expected && checksum64(std::as_bytes(std::span(bytes))) == checksum;
}

}  // namespace

PlaceStore::PlaceStore(std::string name, std::shared_ptr<ByteSource> file, std::vector<StoredPlace> places,
                       std::vector<StoredWord> words, std::uint64_t most_bytes)
    : name_(std::move(name)),
      file_(std::move(file)),
      places_(std::move(places)),
      words_(std::move(words)),
      most_bytes_(most_bytes) {}

void PlaceStore::note(Error error) {
  if (!damage_) damage_ = std::move(error);
}

Result<std::string> PlaceStore::bytes_of(std::size_t slot) const {
  const StoredPlace& p = places_[slot];
  const std::uint64_t count = p.features * std::uint64_t{kFeatureBytes};
  std::string bytes = file_->read(p.at, count);
  if (!is_whole(bytes, count, p.checksum))
    return Error{ErrorCode::malformed,
                 fmt::format("{}: damaged map: keyframe {} is not as it was written", name_, p.keyframe.value)};
  return bytes;
}

Result<Place> PlaceStore::read(std::size_t slot) const {
  const Result<std::string> bytes = bytes_of(slot);
  if (!bytes) return bytes.error();
  BytesIn in(*bytes);
  Place place;
  get_place(in, places_[slot].features, place);
  if (!in.ok())
    return Error{ErrorCode::malformed,
                 fmt::format("{}: damaged map: keyframe {} makes no sense", name_, places_[slot].keyframe.value)};
  return place;
}

std::shared_ptr<Place> PlaceStore::place(std::size_t slot) {
  if (const auto known = by_slot_.find(slot); known != by_slot_.end()) {
    held_.splice(held_.begin(), held_, known->second);
    return held_.front().place;
  }
  Result<Place> place = read(slot);
  if (!place) note(place.error());
  const std::uint64_t bytes = kOverhead_bytes + (place ? place->size() * std::uint64_t{kFeatureBytes} : 0);
  held_.push_front({slot, std::make_shared<Place>(place ? *std::move(place) : Place{}), bytes});
  by_slot_[slot] = held_.begin();
  held_bytes_ += bytes;
  while (held_bytes_ > most_bytes_ && held_.size() > 1) {
    held_bytes_ -= held_.back().bytes;
    by_slot_.erase(held_.back().slot);
    held_.pop_back();
  }
  return held_.front().place;
}

std::span<const WordPosting> PlaceStore::postings(std::int32_t word) {
  const auto at = std::ranges::lower_bound(words_, word, {}, &StoredWord::word);
  return at != words_.end() && at->word == word ? postings(*at) : std::span<const WordPosting>{};
}

std::span<const WordPosting> PlaceStore::postings(const StoredWord& word) {
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
