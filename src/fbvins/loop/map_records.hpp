// SPDX-License-Identifier: Apache-2.0
// Private: the parts of a map file that both versions of its format have (docs/derivations/loop.md, L15). Pure functions.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/loop/map_bytes.hpp"
#include "fbvins/loop/place_map.hpp"

namespace fbvins {

// A file of version 2: header (name, version, flags), places, lists of the keyframes of each word, front, end.
inline constexpr std::string_view kMapName = "FBVPLACE";
inline constexpr std::size_t kMapHeaderBytes = kMapName.size() + 8;

/// The last bytes of a file of version 2.
struct MapEnd {
  std::uint64_t front_at = 0, front_bytes = 0, checksum = 0;
};
std::uint64_t map_checksum(std::string_view bytes);
/// `name` is the file's.
Error damaged_map(const std::string& name, std::string_view what);

/// Flags: descriptors are boosted; a name follows the edges, and anchors follow it; M is their frame; what is remembered of
/// sessions comes then, and tags that are landmarks; of sessions their scales are remembered; several cameras saw the places,
/// which comes last.
inline constexpr std::uint32_t kMapBoosted = 1, kMapNamed = 2, kMapAnchors = 4, kMapAnchored = 8, kMapMemory = 16, kMapTags = 32,
                               kMapScales = 64, kMapCameras = 128;
inline constexpr std::uint32_t kMapFlags =
    kMapBoosted | kMapNamed | kMapAnchors | kMapAnchored | kMapMemory | kMapTags | kMapScales | kMapCameras;

/// Bytes of a feature with its descriptor.
inline constexpr std::size_t kFeatureBytes = sizeof(PlaceFeature) + sizeof(Descriptor);

/// All of a keyframe but its place; `features` of the latter.
void put_keyframe(BytesOut& out, const MapKeyframe& k, std::uint32_t features);
MapKeyframe get_keyframe(BytesIn& in, std::uint32_t& features);

void put_words(BytesOut& out, const BowVector& words);
void get_words(BytesIn& in, std::uint32_t count, BowVector& words);

void put_place(BytesOut& out, const Place& place);
void get_place(BytesIn& in, std::uint32_t features, Place& place);

/// What a file says besides its keyframes. Of `map` what has a place in M.
struct MapRest {
  std::vector<const MapEdge*> edges;
  std::string name;
  std::vector<const MapAnchor*> anchors;
  std::vector<const MapTag*> tags;
  std::vector<MapSession> sessions;    ///< none where there is one only, which its keyframes show, and that is metric
  std::vector<Pose<B, C0>> cameras;    ///< but the first
  std::vector<std::uint16_t> seen_by;  ///< of each keyframe; none where the first camera saw all
};
MapRest rest_of(const PlaceMap& map);
std::uint32_t flags_of(const PlaceMap& map, const MapRest& rest);
void put_rest(BytesOut& out, const MapRest& rest);
/// Into a map that has its keyframes.
void get_rest(BytesIn& in, std::uint32_t edges, std::uint32_t flags, PlaceMap& map);
/// MapKeyframe::missed of each, where sessions are remembered.
void put_missed(BytesOut& out, const PlaceMap& map);
void get_missed(BytesIn& in, std::uint32_t flags, PlaceMap& map);

}  // namespace fbvins
