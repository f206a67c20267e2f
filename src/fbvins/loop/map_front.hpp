// SPDX-License-Identifier: Apache-2.0
// Private: map files of version 2, of which the front (poses, edges, where the rest lies) is read when they are opened, places
// and words later (docs/derivations/loop.md, L15). Functions; a PlaceMap that is read so has a PlaceStore.
//
//   Result<PlaceMap> map = read_front(*open_bytes("building.fbm"), "building.fbm", 200'000'000);
//   Result<void> whole = read_places(*map);        // all of it into memory
#pragma once

#include <memory>
#include <string>

#include "fbvins/core/byte_source.hpp"
#include "fbvins/loop/place_map.hpp"

namespace fbvins {

/// Of a file of which is known that it is a map of version 2. Of its places up to `most_bytes` are kept in memory.
Result<PlaceMap> read_front(std::shared_ptr<ByteSource> file, const std::string& name, std::uint64_t most_bytes);

/// Places and words into the keyframes; the file is not needed any more.
Result<void> read_places(PlaceMap& map);
/// The same of a map that was just opened, and all of its file is checked.
Result<PlaceMap> read_whole(Result<PlaceMap> map, const std::string& name);

}  // namespace fbvins
