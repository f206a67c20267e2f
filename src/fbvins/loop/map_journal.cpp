// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_journal.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "fbvins/core/atomic_file.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/map_front.hpp"
#include "fbvins/loop/map_records.hpp"
#include "fbvins/loop/map_sessions.hpp"
#include "fbvins/loop/map_writer.hpp"
#include "fbvins/loop/place_store.hpp"

namespace fbvins {
namespace {

// A journal: header (name, version, identity of the map's file, checksum of these), then blocks: checksum, kind, length, payload.
constexpr std::string_view kJournalName = "FBVJOURN";
constexpr std::uint32_t kJournalVersion = 1;
constexpr std::size_t kHeaderBytes = kJournalName.size() + 24, kBlockHeadBytes = 16;
enum BlockKind : std::uint32_t { kPlaceBlock = 1, kStateBlock = 2 };
/// A journal begins anew when it is larger than twice what is in use of it, and this.
constexpr std::uint64_t kSlackBytes = 1'000'000;

struct BlockHead {
  std::uint64_t checksum = 0;
  std::uint32_t kind = 0, bytes = 0;
};

/// Also of where the block begins: one that was written at another place is not taken for it.
std::uint64_t block_checksum(std::uint64_t at, std::uint32_t kind, std::string_view payload) {
  BytesOut out;
  out.put(at);
  out.put(kind);
  out.put(map_checksum(payload));
  return map_checksum(out.take());
}

void put_block(std::string& out, std::uint64_t at, BlockKind kind, std::string_view payload) {
  BytesOut head;
  head.put(BlockHead{block_checksum(at, kind, payload), kind, static_cast<std::uint32_t>(payload.size())});
  out += head.take();
  out += payload;
}

std::uint64_t identity_of(const ByteSource& file) {
  // Both ends: of either version they hold a checksum, from which those of all other parts follow.
  constexpr std::uint64_t kEnds = 32;
  BytesOut out;
  out.put(file.size());
  const std::string head = file.read(0, kEnds), tail = file.read(file.size() - std::min(file.size(), kEnds), kEnds);
  out.raw(head.data(), head.size());
  out.raw(tail.data(), tail.size());
  return map_checksum(out.take());
}

/// Where there is no file, write_journal() makes one of an empty map.
const MapBase& base_for(const PlaceMap& map) {
  static const std::shared_ptr<const MapBase> none = base_of(PlaceMap{}, *bytes_in_memory(serialise_map(PlaceMap{})));
  return map.base ? *map.base : *none;
}

std::string header_for(const MapBase& base) {
  BytesOut out;
  out.raw(kJournalName.data(), kJournalName.size());
  out.put(kJournalVersion);
  out.put(std::uint32_t{0});
  out.put(base.identity);
  std::string header = out.take();
  BytesOut sum;
  sum.put(map_checksum(header));
  return header + sum.take();
}

bool same(const Pose<M, B>& a, const Pose<M, B>& b) { return a.p == b.p && a.q.coeffs() == b.q.coeffs(); }

/// The keyframes of `map` that are not in its file, and of those that are the ones that have changed.
struct Difference {
  std::vector<const MapKeyframe*> added, changed;
};

std::optional<Difference> difference(const PlaceMap& map, const MapBase& base) {
  Difference d;
  const Pose<B, C0>& first = map.cameras[0];
  const bool other_body = first.p != base.T_BC0.p || first.q.coeffs() != base.T_BC0.q.coeffs();
  auto in_file = base.keyframes.begin();
  for (const MapKeyframe& k : map.keyframes()) {
    if (in_file == base.keyframes.end()) {
      if (k.placed) d.added.push_back(&k);
      continue;
    }
    if (in_file->id != k.id) return std::nullopt;
    if (other_body || !same(k.T_MB, in_file->T_MB) || k.loops_ending_here != in_file->loops_ending_here) d.changed.push_back(&k);
    ++in_file;
  }
  return in_file == base.keyframes.end() ? std::optional(std::move(d)) : std::nullopt;
}

void put_changed(BytesOut& out, const std::vector<const MapKeyframe*>& changed) {
  out.put(static_cast<std::uint32_t>(changed.size()));
  for (const MapKeyframe* k : changed) {
    out.put(k->id.value);
    out.put(k->T_MB);
    out.put(static_cast<std::int32_t>(k->loops_ending_here));
  }
}

/// Edges of the file stand before all others, and stay.
MapRest rest_beyond(const PlaceMap& map, const MapBase& base) {
  MapRest rest = rest_of(map);
  rest.edges.erase(rest.edges.begin(), rest.edges.begin() + static_cast<std::ptrdiff_t>(base.edges));
  return rest;
}

/// Payloads of the whole places of a journal, by where they lie, and its newest whole state.
struct Blocks {
  std::map<std::uint64_t, std::uint32_t> places;
  std::string state;
  std::optional<std::uint64_t> damaged_at;  ///< a block is all there and yet not what was written
};

/// Up to the first block that is not whole: a program that is killed leaves a part of its last one.
Blocks blocks_of(const ByteSource& journal) {
  Blocks blocks;
  std::string head, payload;
  for (std::uint64_t at = kHeaderBytes;;) {
    journal.fill(head, at, kBlockHeadBytes);
    if (head.size() < kBlockHeadBytes) return blocks;
    const auto block = BytesIn(head).get<BlockHead>();
    journal.fill(payload, at + kBlockHeadBytes, block.bytes);
    if (payload.size() < block.bytes) return blocks;
    if (block.checksum != block_checksum(at, block.kind, payload)) {
      const bool unwritten = std::ranges::all_of(head, [](char c) { return c == 0; });  // of a disk without power
      if (!unwritten) blocks.damaged_at = at;
      return blocks;
    }
    if (block.kind == kPlaceBlock) blocks.places.emplace(at + kBlockHeadBytes, block.bytes);
    if (block.kind == kStateBlock) blocks.state = payload;
    at += kBlockHeadBytes + block.bytes;
  }
}

void get_added(BytesIn& in, const ByteSource& journal, const Blocks& blocks, PlaceMap& map) {
  const auto count = in.get<std::uint32_t>();
  KeyframeId last = map.empty() ? KeyframeId{} : map.keyframes().back().id;
  for (std::uint32_t i = 0; i < count && in.ok(); ++i) {
    std::uint32_t features = 0;
    MapKeyframe k = get_keyframe(in, features);
    k.missed = in.get<std::int32_t>();
    const auto words = in.get<std::uint32_t>();
    const auto at = in.get<std::uint64_t>();
    in.check(k.id > last && k.id.value < (std::int64_t{1} << 31));
    last = k.id;
    const auto block = blocks.places.find(at);
    in.check(block != blocks.places.end() &&
             block->second == features * std::uint64_t{kFeatureBytes} + words * std::uint64_t{sizeof(BowEntry)});
    if (!in.ok()) return;
    const std::string bytes = journal.read(at, block->second);
    BytesIn place(bytes);
    get_place(place, features, k.place);
    get_words(place, words, k.place.words);
    in.check(place.ok() && place.at_end());
    if (in.ok()) map.add(std::move(k));
  }
}

void get_changed(BytesIn& in, PlaceMap& map) {
  const auto count = in.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < count && in.ok(); ++i) {
    MapKeyframe* k = map.find(KeyframeId{in.get<std::int64_t>()});
    const auto T_MB = in.pose<Pose<M, B>>();
    const auto loops = in.get<std::int32_t>();
    in.check(k != nullptr);
    if (in.ok()) k->T_MB = T_MB, k->loops_ending_here = loops;
  }
}

/// Words of two vocabularies do not go together: then a flight makes those of all places anew.
Result<void> take_vocabulary(PlaceMap& map, std::uint64_t vocabulary) {
  if (map.empty()) map.vocabulary = vocabulary;
  if (map.vocabulary == vocabulary) return {};
  map.vocabulary = 0;
  return read_places(map);
}

Result<void> apply(BytesIn& in, const ByteSource& journal, const Blocks& blocks, PlaceMap& map) {
  const auto flags = in.get<std::uint32_t>();
  const auto vocabulary = in.get<std::uint64_t>();
  const auto T_BC0 = in.pose<Pose<B, C0>>();
  in.check((flags & ~kMapFlags) == 0 && (map.empty() || map.boosted == ((flags & kMapBoosted) != 0)));
  if (!in.ok()) return {};
  if (Result<void> taken = take_vocabulary(map, vocabulary); !taken) return taken;
  change_body(map, T_BC0);
  map.boosted = (flags & kMapBoosted) != 0;
  map.anchored = (flags & kMapAnchored) != 0;
  get_changed(in, map);
  get_added(in, journal, blocks, map);
  const auto edges = in.get<std::uint32_t>();
  map.name.clear(), map.anchors.clear(), map.tags.clear(), map.sessions.clear();
  get_rest(in, edges, flags, map);
  in.check(in.at_end());
  remember_sessions(map);
  return {};
}

}  // namespace

std::shared_ptr<const MapBase> base_of(const PlaceMap& map, const ByteSource& file) {
  MapBase base{identity_of(file), map.cameras[0], {}, map.edges.size()};
  for (const MapKeyframe& k : map.keyframes()) base.keyframes.push_back({k.id, k.T_MB, k.loops_ending_here});
  return std::make_shared<const MapBase>(std::move(base));
}

Result<std::string> MapJournal::news(const PlaceMap& map) {
  const MapBase& base = base_for(map);
  const std::optional<Difference> d = difference(map, base);
  if (!d) return Error{ErrorCode::invalid_argument, "keyframes of the map's file are not in the map any more"};
  if (!begun_ && d->added.empty() && d->changed.empty()) return std::string();
  if (size_ > 2 * in_use_ + kSlackBytes) begin_anew();
  begun_ = true;
  std::string out = size_ == 0 ? header_for(base) : "";
  const MapRest rest = rest_beyond(map, base);
  BytesOut state;
  state.put(flags_of(map, rest));
  state.put(map.vocabulary);
  state.put(map.cameras[0]);
  put_changed(state, d->changed);
  state.put(static_cast<std::uint32_t>(d->added.size()));
  in_use_ = kHeaderBytes;
  for (const MapKeyframe* k : d->added) {
    const Result<PlaceRecord> record = record_of(map, *k);
    if (!record) return record.error();
    const auto [place, is_new] = places_.try_emplace(k->id, size_ + out.size() + kBlockHeadBytes);
    if (is_new) put_block(out, size_ + out.size(), kPlaceBlock, record->bytes);
    put_keyframe(state, *k, static_cast<std::uint32_t>(record->features));
    state.put(static_cast<std::int32_t>(k->missed));
    state.put(static_cast<std::uint32_t>(record->words));
    state.put(place->second);
    in_use_ += kBlockHeadBytes + record->bytes.size();
  }
  state.put(static_cast<std::uint32_t>(rest.edges.size()));
  put_rest(state, rest);
  const std::string newest = state.take();
  const std::uint64_t sum = map_checksum(newest);
  if (size_ > 0 && sum == state_) return std::string();
  state_ = sum;
  put_block(out, size_ + out.size(), kStateBlock, newest);
  in_use_ += kBlockHeadBytes + newest.size();
  size_ += out.size();
  return out;
}

void MapJournal::begin_anew() {
  places_.clear();
  size_ = in_use_ = 0;
}

Result<PlaceMap> with_journal(PlaceMap map, const ByteSource& journal, const std::string& name) {
  const std::string header = journal.read(0, kHeaderBytes);
  if (header.size() < kHeaderBytes || !header.starts_with(kJournalName)) return damaged_map(name, "not a journal");
  BytesIn in(std::string_view(header).substr(kJournalName.size()));
  const auto version = in.get<std::uint32_t>();
  (void)in.get<std::uint32_t>();
  const auto identity = in.get<std::uint64_t>();
  if (in.get<std::uint64_t>() != map_checksum(std::string_view(header).substr(0, kHeaderBytes - 8)))
    return damaged_map(name, "the checksum of its header differs");
  if (version != kJournalVersion)
    return Error{ErrorCode::unsupported,
                 fmt::format("{}: journal of version {}, this program reads {}", name, version, kJournalVersion)};
  if (!map.base || map.base->identity != identity) return map;
  const Blocks blocks = blocks_of(journal);
  if (blocks.damaged_at)
    return damaged_map(name,
                       fmt::format("a checksum differs at byte {}; without this file the map is as it was before the flight",
                                   *blocks.damaged_at));
  if (blocks.state.empty()) return map;
  BytesIn state(blocks.state);
  if (Result<void> applied = apply(state, journal, blocks, map); !applied) return applied.error();
  if (!state.ok()) return damaged_map(name, "its content makes no sense");
  return map;
}

Result<PlaceMap> with_journal(Result<PlaceMap> map, const std::string& path) {
  if (!map) return map;
  const auto journal = open_bytes(journal_of(path));
  if (!journal && journal.error().code == ErrorCode::not_found) return map;
  if (!journal) return journal.error();
  return with_journal(*std::move(map), **journal, journal_of(path));
}

std::string journal_of(const std::string& path) { return path + ".journal"; }

Result<void> write_journal(const std::string& path, std::string_view news) {
  if (!news.starts_with(kJournalName)) return append_to_file(journal_of(path), news);
  // The file first: a journal alone, left by a program that was killed, belongs to nothing.
  std::error_code unknown;
  if (!std::filesystem::exists(path, unknown))
    if (Result<void> done = write_file_atomically(path, serialise_map(PlaceMap{})); !done) return done;
  return write_file_atomically(journal_of(path), news);
}

void remove_journal(const std::string& path) { (void)::unlink(journal_of(path).c_str()); }

}  // namespace fbvins
