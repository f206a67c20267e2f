// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_front.hpp"

#include <fmt/format.h>

#include "fbvins/loop/map_records.hpp"
#include "fbvins/loop/map_sessions.hpp"
#include "fbvins/loop/map_writer.hpp"
#include "fbvins/loop/place_store.hpp"

namespace fbvins {
namespace {

/// Keyframes of a front, and where their places lie; returns where these end.
std::uint64_t get_keyframes(BytesIn& in, std::uint32_t count, PlaceMap& map, std::vector<StoredPlace>& places) {
  std::uint64_t at = kMapHeaderBytes;
  KeyframeId last;
  for (std::uint32_t i = 0; i < count && in.ok(); ++i) {
    StoredPlace place;
    place.at = at;
    MapKeyframe k = get_keyframe(in, place.features);
    place.checksum = in.get<std::uint64_t>();
    place.words = in.get<std::uint32_t>();
    place.words_checksum = in.get<std::uint64_t>();
    place.keyframe = k.id;
    at += place.place_bytes() + place.words_bytes();
    in.check(place.words == 0 || map.vocabulary != 0);
    in.check(k.id > last && k.id.value < (std::int64_t{1} << 31));
    last = k.id;
    k.stored = static_cast<std::int32_t>(i);
    places.push_back(place);
    if (in.ok()) map.add(std::move(k));
  }
  return at;
}

/// Where the keyframes of each word are listed, from `at` on; returns where that ends.
std::uint64_t get_lists(BytesIn& in, std::uint64_t at, std::vector<StoredWord>& words) {
  const auto count = in.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < count && in.ok(); ++i) {
    StoredWord word;
    word.at = at;
    word.word = in.get<std::int32_t>();
    word.keyframes = in.get<std::uint32_t>();
    word.checksum = in.get<std::uint64_t>();
    in.check(word.word > (words.empty() ? -1 : words.back().word) && word.keyframes > 0);
    at += word.keyframes * std::uint64_t{sizeof(WordPosting)};
    words.push_back(word);
  }
  return at;
}

}  // namespace

Result<PlaceMap> read_front(std::shared_ptr<ByteSource> file, const std::string& name, std::uint64_t most_bytes) {
  if (file->size() < kMapHeaderBytes + sizeof(MapEnd)) return damaged_map(name, "too short");
  const std::string header = file->read(0, kMapHeaderBytes), tail = file->read(file->size() - sizeof(MapEnd), sizeof(MapEnd));
  BytesIn beginning(std::string_view(header).substr(kMapName.size() + 4)), ending(tail);
  const auto flags = beginning.get<std::uint32_t>();
  const auto end = ending.get<MapEnd>();
  if (!beginning.ok() || !ending.ok()) return Error{ErrorCode::unreadable, fmt::format("{}: cannot be read", name)};
  if ((flags & ~kMapFlags) != 0) return damaged_map(name, "unknown flags");
  if (end.front_bytes > file->size() - sizeof(MapEnd) || end.front_at != file->size() - sizeof(MapEnd) - end.front_bytes)
    return damaged_map(name, "cut short or grown");
  const std::string front = file->read(end.front_at, end.front_bytes);
  if (front.size() != end.front_bytes || (map_checksum(front) ^ flags) != end.checksum)
    return damaged_map(name, "the checksum differs");

  BytesIn in(front);
  PlaceMap map;
  std::vector<StoredPlace> places;
  std::vector<StoredWord> words;
  map.boosted = (flags & kMapBoosted) != 0;
  map.anchored = (flags & kMapAnchored) != 0;
  const auto keyframes = in.get<std::uint32_t>(), edges = in.get<std::uint32_t>();
  map.vocabulary = in.get<std::uint64_t>();
  map.cameras[0] = in.pose<Pose<B, C0>>();
  const std::uint64_t places_end = get_keyframes(in, keyframes, map, places);
  get_rest(in, edges, flags, map);
  get_missed(in, flags, map);
  if (in.ok() && map.vocabulary != 0) in.check(get_lists(in, places_end, words) == end.front_at);
  else in.check(places_end == end.front_at);
  if (!in.ok() || !in.at_end()) return damaged_map(name, "its content makes no sense");
  map.store = std::make_shared<PlaceStore>(name, std::move(file), std::move(places), std::move(words), most_bytes);
  remember_sessions(map);
  return map;
}

Result<void> read_places(PlaceMap& map) {
  if (!map.store) return {};
  for (MapKeyframe& k : map.keyframes()) {
    if (k.stored < 0) continue;
    Place place = *map.place_of(k);
    place.words = *map.words_of(k);
    k.place = std::move(place);
  }
  if (const std::optional<Error>& damage = map.store->damage()) return *damage;
  for (MapKeyframe& k : map.keyframes()) k.stored = -1;
  map.store = nullptr;
  return {};
}

Result<PlaceMap> read_whole(Result<PlaceMap> map, const std::string& name) {
  if (!map || !map->store) return map;
  const std::shared_ptr<PlaceStore> store = map->store;
  for (const StoredWord& word : store->words()) (void)store->keyframes_with(word);  // finds what is damaged
  if (Result<void> read = read_places(*map); !read) return read.error();
  if (!lists_agree(*map, store->words())) return damaged_map(name, "its content makes no sense");
  return map;
}

}  // namespace fbvins
