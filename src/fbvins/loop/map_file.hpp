// SPDX-License-Identifier: Apache-2.0
// Maps on disk: versioned, with a checksum, replaced as a whole (docs/derivations/loop.md, L15). Places without a
// pose in M are left out. Pure functions but for the file.
//
//   Result<void> saved = save_map(closer.map(), "flat.fbm");
//   Result<PlaceMap> map = load_map("flat.fbm");
//   Result<PlaceMap> building = open_map("building.fbm", 200'000'000);
#pragma once

#include <span>
#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/loop/place_map.hpp"

namespace fbvins {

/// Files of version 1 are read as well.
inline constexpr std::uint32_t kMapVersion = 2;

/// Bytes of a map as in the file: the same map gives the same bytes, whether its places are in memory or in a file. An error
/// where they are in a file and cannot be read.
Result<std::string> map_bytes(const PlaceMap& map);
/// The same of a map in memory.
std::string serialise_map(const PlaceMap& map);
/// `name` is for messages only. Damaged bytes are an error that says what is wrong.
Result<PlaceMap> parse_map(std::span<const std::byte> bytes, const std::string& name);

/// The journal beside the file, if there is one, is removed: the map has what is in it.
Result<void> save_map(const PlaceMap& map, const std::string& path);
/// The same of bytes: those of a map replace the file, those of MapJournal::news() go into the journal beside it.
Result<void> write_map_bytes(const std::string& path, std::string_view bytes);
/// With what the journal beside the file adds, if there is one. All of it into memory, and checked.
Result<PlaceMap> load_map(const std::string& path);
/// Poses and edges; places and words are read, and checked, when they are asked for, and of places as many stay in memory as fit
/// into `most_bytes`. The file may be replaced meanwhile (save_map), not written to. Of version 1: all of it into memory.
Result<PlaceMap> open_map(const std::string& path, std::uint64_t most_bytes);

/// Points of all places in M as ASCII PLY, each coloured by how far it was from its camera (near: bright).
std::string map_as_ply(const PlaceMap& map);
/// Keyframes in M, TUM format.
std::string map_as_tum(const PlaceMap& map);

}  // namespace fbvins
