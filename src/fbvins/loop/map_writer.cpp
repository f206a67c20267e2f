// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_writer.hpp"

#include <algorithm>
#include <tuple>

#include "fbvins/loop/binary_file.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/map_records.hpp"
#include "fbvins/loop/place_store.hpp"

namespace fbvins {
namespace {

/// Words of the keyframes that are in memory, and of those that are in a file.
class WordLists {
 public:
  explicit WordLists(const PlaceMap& map) : store_(map.vocabulary != 0 ? map.store.get() : nullptr) {
    if (map.vocabulary == 0) return;
    if (store_ != nullptr) renumbered_.assign(store_->size(), -1);
    std::int32_t slot = 0;
    for (const MapKeyframe& k : map.keyframes()) {
      if (!k.placed) continue;
      if (k.stored >= 0) renumbered_[static_cast<std::size_t>(k.stored)] = slot;
      else
        for (const BowEntry& e : k.place.words) fresh_.push_back({e.word, {static_cast<std::uint32_t>(slot), e.weight}});
      ++slot;
    }
    std::ranges::stable_sort(fresh_, {}, &Fresh::word);
  }

  /// The next word that some keyframe has, with these keyframes; nothing is left where there are none.
  std::pair<std::int32_t, std::span<const WordPosting>> next() {
    list_.clear();
    std::int32_t word = 0;
    while (list_.empty() && (fresh_at_ < fresh_.size() || stored_left())) {
      word = std::min(fresh_at_ < fresh_.size() ? fresh_[fresh_at_].word : INT32_MAX, stored_left() ? stored().word : INT32_MAX);
      if (stored_left() && stored().word == word) take_stored();
      for (; fresh_at_ < fresh_.size() && fresh_[fresh_at_].word == word; ++fresh_at_) list_.push_back(fresh_[fresh_at_].posting);
    }
    return {word, list_};
  }

 private:
  struct Fresh {
    std::int32_t word;
    WordPosting posting;
  };
  bool stored_left() const { return store_ != nullptr && stored_at_ < store_->words().size(); }
  const StoredWord& stored() const { return store_->words()[stored_at_]; }
  void take_stored() {
    for (const WordPosting& p : store_->keyframes_with(stored()))
      if (const std::int32_t slot = renumbered_[p.slot]; slot >= 0) list_.push_back({static_cast<std::uint32_t>(slot), p.weight});
    ++stored_at_;
  }

  PlaceStore* store_;
  std::vector<std::int32_t> renumbered_;  ///< new slots of those in the file; -1: it is gone
  std::vector<Fresh> fresh_;              ///< of keyframes that came later than those in the file
  std::size_t fresh_at_ = 0, stored_at_ = 0;
  std::vector<WordPosting> list_;
};

/// Counts what it passes on.
class CountedOutput {
 public:
  explicit CountedOutput(const std::function<void(std::string_view)>& write) : write_(write) {}
  void put(std::string_view bytes) {
    write_(bytes);
    written_ += bytes.size();
  }
  std::uint64_t written() const { return written_; }

 private:
  const std::function<void(std::string_view)>& write_;
  std::uint64_t written_ = 0;
};

/// The places go to `out`, what the front says of keyframes is the result.
Result<std::string> put_places(const PlaceMap& map, CountedOutput& out) {
  BytesOut keyframes;
  for (const MapKeyframe& k : map.keyframes()) {
    if (!k.placed) continue;
    const Result<PlaceRecord> record = record_of(map, k);
    if (!record) return record.error();
    const std::string_view bytes = record->bytes;
    const std::size_t of_place = record->features * kFeatureBytes;
    put_keyframe(keyframes, k, static_cast<std::uint32_t>(record->features));
    keyframes.put(map_checksum(bytes.substr(0, of_place)));
    keyframes.put(static_cast<std::uint32_t>(record->words));
    keyframes.put(map_checksum(bytes.substr(of_place)));
    out.put(bytes);
  }
  return keyframes.take();
}

/// The lists go to `out`, what the front says of them is the result.
std::string put_lists(const PlaceMap& map, CountedOutput& out) {
  if (map.vocabulary == 0) return {};
  BytesOut words;
  std::uint32_t count = 0;
  WordLists lists(map);
  for (auto [word, list] = lists.next(); !list.empty(); std::tie(word, list) = lists.next(), ++count) {
    const std::string_view bytes(reinterpret_cast<const char*>(list.data()), list.size_bytes());
    out.put(bytes);
    words.put(word);
    words.put(static_cast<std::uint32_t>(list.size()));
    words.put(map_checksum(bytes));
  }
  BytesOut counted;
  counted.put(count);
  return counted.take() + words.take();
}

}  // namespace

Result<PlaceRecord> record_of(const PlaceMap& map, const MapKeyframe& k) {
  if (k.stored >= 0) {
    const StoredPlace& stored = map.store->at(static_cast<std::size_t>(k.stored));
    Result<std::string> bytes = map.store->bytes_of(static_cast<std::size_t>(k.stored));
    if (!bytes) return bytes.error();
    return PlaceRecord{*std::move(bytes), stored.features, stored.words};
  }
  BytesOut place;
  put_place(place, k.place);
  if (map.vocabulary != 0) put_words(place, k.place.words);
  return PlaceRecord{place.take(), k.place.size(), map.vocabulary != 0 ? k.place.words.size() : 0};
}

bool lists_agree(const PlaceMap& map, const std::vector<StoredWord>& words) {
  WordLists lists(map);
  for (const StoredWord& w : words) {
    const auto [word, list] = lists.next();
    const std::string_view bytes(reinterpret_cast<const char*>(list.data()), list.size_bytes());
    if (list.empty() || word != w.word || list.size() != w.keyframes || map_checksum(bytes) != w.checksum) return false;
  }
  return lists.next().second.empty();
}

Result<void> write_map(const PlaceMap& map, const std::function<void(std::string_view)>& write) {
  const MapRest rest = rest_of(map);
  const std::uint32_t flags = flags_of(map, rest);
  CountedOutput out(write);
  BytesOut header, front, end;
  header.raw(kMapName.data(), kMapName.size());
  header.put(kMapVersion);
  header.put(flags);
  out.put(header.take());
  const Result<std::string> keyframes = put_places(map, out);
  if (!keyframes) return keyframes.error();
  const std::string words = put_lists(map, out);
  if (map.store && map.store->damage()) return *map.store->damage();
  const std::uint64_t front_at = out.written();
  front.put(static_cast<std::uint32_t>(std::ranges::count_if(map.keyframes(), &MapKeyframe::placed)));
  front.put(static_cast<std::uint32_t>(rest.edges.size()));
  front.put(map.vocabulary);
  front.put(map.cameras[0]);
  front.raw(keyframes->data(), keyframes->size());
  put_rest(front, rest);
  if ((flags & kMapMemory) != 0) put_missed(front, map);
  front.raw(words.data(), words.size());
  const std::string bytes = front.take();
  out.put(bytes);
  end.put(MapEnd{front_at, bytes.size(), map_checksum(bytes) ^ flags});
  out.put(end.take());
  return {};
}

}  // namespace fbvins
