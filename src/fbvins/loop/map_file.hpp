// SPDX-License-Identifier: Apache-2.0
// Maps on disk: versioned, with a checksum, replaced as a whole (docs/derivations/loop.md, L15). Places without a
// pose in M are left out. Pure functions but for the file.
//
//   Result<void> saved = save_map(closer.map(), "flat.fbm");
//   Result<PlaceMap> map = load_map("flat.fbm");
#pragma once

#include <span>
#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/loop/place_map.hpp"

namespace fbvins {

inline constexpr std::uint32_t kMapVersion = 1;

/// Bytes of a map as in the file: the same map gives the same bytes.
std::string serialise_map(const PlaceMap& map);
/// `name` is for messages only. Damaged bytes are an error that says what is wrong.
Result<PlaceMap> parse_map(std::span<const std::byte> bytes, const std::string& name);

Result<void> save_map(const PlaceMap& map, const std::string& path);
Result<PlaceMap> load_map(const std::string& path);

/// Points of all places in M as ASCII PLY, each coloured by how far it was from its camera (near: bright).
std::string map_as_ply(const PlaceMap& map);
/// Keyframes in M, TUM format.
std::string map_as_tum(const PlaceMap& map);

}  // namespace fbvins
