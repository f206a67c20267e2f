// SPDX-License-Identifier: Apache-2.0
// What a flight adds to a map's file, in a journal beside it (FILE.journal), so that keeping the map in flight costs as much as
// is new, however large the file is; every reader of the file reads both (docs/derivations/loop.md, "The journal"). A value of
// one flight; one thread at a time.
//
//   MapJournal journal;
//   Result<std::string> news = journal.news(map);                       // every half minute
//   if (news && !news->empty() && !write_map_bytes(file, *news)) journal.begin_anew();
//   Result<PlaceMap> map = open_map(file, ...);                         // after a kill: to the byte what it was at the last news
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "fbvins/core/byte_source.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/loop/place_map.hpp"

namespace fbvins {

class MapJournal {
 public:
  /// Bytes for write_map_bytes() that bring the file with its journal to this state of the map, which was opened from the file or
  /// begun without one; empty: nothing has changed since the last call. Of keyframes that were handed out before, only what is
  /// not their place is among them. Where most of the journal is out of date, the bytes are those of a new one. An error where a
  /// keyframe of the file is not in the map any more.
  Result<std::string> news(const PlaceMap& map);
  /// The last bytes may not be on the disk: the next ones are those of a new journal.
  void begin_anew();

 private:
  std::map<KeyframeId, std::uint64_t> places_;  ///< where they lie in the journal
  std::uint64_t size_ = 0, in_use_ = 0;         ///< bytes of the journal; of those that the newest state needs
  std::uint64_t state_ = 0;                     ///< checksum of the newest state
  bool begun_ = false;
};

/// What a journal beside the file is to know of it: `map` as it was just read from `file`.
std::shared_ptr<const MapBase> base_of(const PlaceMap& map, const ByteSource& file);

/// The map with what the journal beside its file adds; as it is where there is none, or one that belongs to another file. Of a
/// journal that ends in the middle, as a kill leaves it, the newest whole state counts.
Result<PlaceMap> with_journal(Result<PlaceMap> map, const std::string& path);
/// The same of a journal anywhere; `name` is for messages.
Result<PlaceMap> with_journal(PlaceMap map, const ByteSource& journal, const std::string& name);

std::string journal_of(const std::string& path);
/// Bytes of MapJournal::news() onto the disk. Where there is no file yet, one of an empty map is made.
Result<void> write_journal(const std::string& path, std::string_view news);
void remove_journal(const std::string& path);

}  // namespace fbvins
