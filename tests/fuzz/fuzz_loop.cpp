// SPDX-License-Identifier: Apache-2.0
// Files of maps and vocabularies, as fuzz targets. Lengths and checksums in the header are made to agree with the bytes, which
// mutations change: otherwise every mutation would be refused before it is parsed.
#include <algorithm>
#include <cstring>
#include <span>

#include "fbvins/core/rng.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/loop/binary_file.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/map_front.hpp"
#include "fbvins/loop/map_journal.hpp"
#include "fbvins/loop/place_store.hpp"
#include "fbvins/loop/vocabulary_training.hpp"
#include "tests/broken_datasets/toy_dataset.hpp"
#include "tests/fuzz/fuzz_targets.hpp"
#include "tests/fuzz/named_file.hpp"
#include "tests/fuzz/require.hpp"

namespace fbvins::fuzz {
namespace {

constexpr std::size_t kMapHeader_bytes = 16, kMapFlagsAt = 12, kMapEnd_bytes = 24;
constexpr std::size_t kMapVersionAt = 8, kMap1Header_bytes = 32, kMap1SizeAt = 16, kMap1ChecksumAt = 24;
constexpr std::size_t kJournalHeader_bytes = 32, kJournalIdentityAt = 16, kBlockHead_bytes = 16;
constexpr std::size_t kVocabularyHeader_bytes = 64, kNodesAt = 12, kVocabularyChecksumAt = 48, kNode_bytes = 48;

Descriptor some_descriptor(Rng& rng) { return {{rng.next_u32(), rng.next_u32(), rng.next_u32(), rng.next_u32()}}; }

std::string small_map(bool boosted) {
  Rng rng(5);
  PlaceMap map;
  map.boosted = boosted;
  for (int i = 0; i < 3; ++i) {
    MapKeyframe k;
    k.t = Time{1000 * i};
    k.T_GB.p.x() = k.T_MB.p.x() = i;
    k.place.focal_px = 400;
    for (int f = 0; f < 2; ++f) {
      k.place.features.push_back({0.1f, 0.2f, 0.3f, 0.001f, 0.01f});
      k.place.descriptors.push_back(some_descriptor(rng));
    }
    map.add(std::move(k));
    if (i == 0) continue;
    const auto kind = i == 1 ? MapEdge::Kind::odometry : MapEdge::Kind::loop;
    map.edges.push_back({KeyframeId{i - 1}, KeyframeId{i}, {Quat::Identity(), Vec3(1, 0, 0)}, Mat6::Identity(), kind});
  }
  return serialise_map(map);
}

template <class T>
void overwrite(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

std::uint64_t checksum_from(const std::string& bytes, std::size_t at) {
  return checksum64(std::as_bytes(std::span(bytes)).subspan(at));
}

template <class T>
T value_at(const std::string& bytes, std::size_t at) {
  T value{};
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

std::string with_its_checksum(std::string bytes) {
  if (bytes.size() < kMap1Header_bytes + kMapEnd_bytes) return bytes;
  const auto flags = value_at<std::uint32_t>(bytes, kMapFlagsAt);
  if (value_at<std::uint32_t>(bytes, kMapVersionAt) == 1) {
    overwrite(bytes, kMap1SizeAt, std::uint64_t{bytes.size() - kMap1Header_bytes});
    overwrite(bytes, kMap1ChecksumAt, checksum_from(bytes, kMap1Header_bytes) ^ flags);
    return bytes;
  }
  const std::size_t end = bytes.size() - kMapEnd_bytes;
  const auto front = value_at<std::uint64_t>(bytes, end);
  if (front < kMapHeader_bytes || front > end) return bytes;
  overwrite(bytes, end + 8, std::uint64_t{end - front});
  overwrite(bytes, end + 16, checksum64(std::as_bytes(std::span(bytes)).subspan(front, end - front)) ^ flags);
  return bytes;
}

/// A map of three flights that remembers its sessions, with words.
std::string map_of_many_flights() {
  Rng rng(8);
  PlaceMap map;
  map.vocabulary = 5;
  for (int i = 0; i < 6; ++i) {
    MapKeyframe k;
    k.t = Time{1000 * i};
    k.session = static_cast<std::uint32_t>(i / 2);
    k.missed = i;
    k.T_GB.p.x() = k.T_MB.p.x() = i;
    k.place.focal_px = 400;
    k.place.features.push_back({0.1f, 0.2f, 0.3f, 0.001f, 0.01f});
    k.place.descriptors.push_back(some_descriptor(rng));
    k.place.words = {{3, 0.5f}, {5 + i, 0.5f}};
    MapSession& session = map.session(k.session, k.t);
    session.ended = k.t;
    ++session.keyframes;
    map.add(std::move(k));
    if (i > 0) map.edges.push_back({KeyframeId{i - 1}, KeyframeId{i}, {Quat::Identity(), Vec3(1, 0, 0)}, Mat6::Identity()});
  }
  return serialise_map(map);
}

std::string map_of_version_1() { return *read_file(FBVINS_SOURCE_DIR "/tests/data/map_version_1.fbm", 1u << 20u); }

/// A map whose places stay in the file: whatever is damaged is passed over, and named where it is to be written.
void fuzz_stored(const std::string& bytes) {
  if (!bytes.starts_with("FBVPLACE\2")) return;
  const auto map = read_front(bytes_in_memory(bytes), "map", 0);
  require_sentence(map);
  if (!map || !map->store) return;
  for (const MapKeyframe& k : map->keyframes()) {
    require(map->place_of(k)->size() == map->place_of(k)->descriptors.size());
    (void)map->words_of(k);
  }
  for (const StoredWord& word : map->store->words())
    for (const WordPosting& p : map->store->keyframes_with(word)) require(p.slot < map->size());
  const auto written = map_bytes(*map);
  require_sentence(written);
  require(written.ok() == !map->store->damage());
}

/// Of the map of many flights, all of which is new.
std::string journal() {
  const std::string bytes = map_of_many_flights();
  PlaceMap map = *parse_map(std::as_bytes(std::span(bytes)), "map");
  map.base = nullptr;
  return *MapJournal().news(map);
}

/// Blocks that are whole, of a journal for a file of an empty map.
std::string with_its_blocks(std::string bytes, const PlaceMap& empty) {
  if (bytes.size() < kJournalHeader_bytes) return bytes;
  overwrite(bytes, kJournalIdentityAt, empty.base->identity);
  overwrite(bytes, kJournalIdentityAt + 8, checksum64(std::as_bytes(std::span(bytes)).first(kJournalIdentityAt + 8)));
  for (std::size_t at = kJournalHeader_bytes; at + kBlockHead_bytes <= bytes.size();) {
    const std::size_t begin = at + kBlockHead_bytes;
    const auto count = std::min<std::size_t>(value_at<std::uint32_t>(bytes, at + 12), bytes.size() - begin);
    overwrite(bytes, at + 12, static_cast<std::uint32_t>(count));
    std::string summed(20, '\0');
    overwrite(summed, 0, std::uint64_t{at});
    overwrite(summed, 8, value_at<std::uint32_t>(bytes, at + 8));
    overwrite(summed, 12, checksum64(std::as_bytes(std::span(bytes)).subspan(begin, count)));
    overwrite(bytes, at, checksum_from(summed, 0));
    at = begin + count;
  }
  return bytes;
}

void fuzz_journal(const std::string& bytes) {
  const std::string file = serialise_map(PlaceMap{});
  const auto empty = parse_map(std::as_bytes(std::span(file)), "map");
  for (const std::string& journal : {bytes, with_its_blocks(bytes, *empty)}) {
    const auto map = with_journal(*empty, *bytes_in_memory(journal), "map");
    require_sentence(map);
    require(!map || map_bytes(*map).ok());
  }
}

std::string with_whole_nodes(std::string bytes) {
  if (bytes.size() < kVocabularyHeader_bytes) return bytes;
  const std::size_t nodes = (bytes.size() - kVocabularyHeader_bytes) / kNode_bytes;
  bytes.resize(kVocabularyHeader_bytes + nodes * kNode_bytes);
  overwrite(bytes, kNodesAt, static_cast<std::uint32_t>(nodes));
  overwrite(bytes, kVocabularyChecksumAt, checksum_from(bytes, kVocabularyHeader_bytes));
  return bytes;
}

}  // namespace

std::vector<std::string> map_seeds() {
  return {small_map(false), small_map(true), serialise_map(PlaceMap{}), map_of_many_flights(), map_of_version_1(), journal()};
}

/// What is read is written as the same bytes again.
void fuzz_map(std::string_view bytes) {
  if (bytes.starts_with("FBVJOURN")) return fuzz_journal(std::string(bytes));
  require_sentence(parse_map(std::as_bytes(std::span(bytes)), "map"));
  const std::string whole = with_its_checksum(std::string(bytes));
  fuzz_stored(whole);
  const auto map = parse_map(std::as_bytes(std::span(whole)), "map");
  require_sentence(map);
  if (!map) return;
  const std::string written = serialise_map(*map);
  // Files of before do not list their sessions.
  require(written == whole || map->sessions.size() > 1 || value_at<std::uint32_t>(whole, kMapVersionAt) == 1);
  const auto again = parse_map(std::as_bytes(std::span(written)), "map");
  require(again.ok() && serialise_map(*again) == written);
  require(!map_as_ply(*map).empty());
  require(static_cast<std::size_t>(std::ranges::count(map_as_tum(*map), '\n')) == map->size());
}

std::vector<std::string> vocabulary_seeds() {
  Rng rng(6);
  std::vector<std::vector<Descriptor>> images(3);
  for (auto& image : images)
    for (int i = 0; i < 20; ++i) image.push_back(some_descriptor(rng));
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/words.fbv";
  require(train_vocabulary("orb", images, {.branching = 3, .depth = 2, .min_members = 4}).save(path).ok());
  return {*read_file(path, 1u << 20u)};
}

/// Every descriptor has a word.
void fuzz_vocabulary(std::string_view bytes) {
  static const NamedFile file("fbv");
  require_sentence(Vocabulary::open(file.with(bytes)));
  const auto vocabulary = Vocabulary::open(file.with(with_whole_nodes(std::string(bytes))));
  require_sentence(vocabulary);
  if (!vocabulary) return;
  Rng rng(7);
  for (int i = 0; i < 10; ++i) {
    const std::int32_t word = vocabulary->word_of(some_descriptor(rng));
    require(word >= 0 && word < vocabulary->words());
  }
}

}  // namespace fbvins::fuzz
