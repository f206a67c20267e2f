// SPDX-License-Identifier: Apache-2.0
// Private: writes map files of version 2, piece by piece: of a map whose places are in a file only a few of them are in memory at
// a time (docs/derivations/loop.md, L15). Pure function.
//
//   Result<void> written = write_map(map, [&](std::string_view bytes) { file.write(bytes); });
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/loop/place_map.hpp"
#include "fbvins/loop/place_store.hpp"

namespace fbvins {

/// What is in a file already is copied from there; an error where that cannot be read. The same map gives the same bytes, whether
/// its places are in memory or not.
Result<void> write_map(const PlaceMap& map, const std::function<void(std::string_view)>& write);

/// A place with its words, without them where no vocabulary is known.
struct PlaceRecord {
  std::string bytes;
  std::size_t features = 0, words = 0;
};
Result<PlaceRecord> record_of(const PlaceMap& map, const MapKeyframe& k);

/// Whether a file whose keyframes are those of `map` says the same of the words.
bool lists_agree(const PlaceMap& map, const std::vector<StoredWord>& words);

}  // namespace fbvins
