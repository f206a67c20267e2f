// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "fbvins/geometry/ldlt.hpp"
#include "fbvins/loop/binary_file.hpp"

namespace fbvins {
namespace {

static_assert(sizeof(PlaceFeature) == 20 && sizeof(Descriptor) == 32 && sizeof(BowEntry) == 8);
constexpr std::size_t kLongestName = 200;
constexpr std::uint32_t kMostFurtherCameras = 0xffff;
constexpr double kLargestScale = 2;  // as a logarithm, and as a standard deviation

void put_information(BytesOut& out, const Mat6& information) {
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) out.put(information(i, j));
}

Mat6 get_information(BytesIn& in) {
  Mat6 information;
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) information(i, j) = information(j, i) = in.get<double>();
  return information;
}

void put_edge(BytesOut& out, const MapEdge& e) {
  out.put(e.from.value);
  out.put(e.to.value);
  out.put(static_cast<std::uint32_t>(e.kind));
  out.put(e.T_from_to);
  put_information(out, e.information);
}

MapEdge get_edge(BytesIn& in) {
  MapEdge e;
  e.from.value = in.get<std::int64_t>();
  e.to.value = in.get<std::int64_t>();
  const auto kind = in.get<std::uint32_t>();
  in.check(kind <= 1);
  e.kind = static_cast<MapEdge::Kind>(kind);
  e.T_from_to = in.pose<Pose<B, B>>();
  e.information = get_information(in);
  // The pose graph takes roots of it.
  in.check(e.information.allFinite() && is_positive_definite(e.information));
  return e;
}

void put_anchor(BytesOut& out, const MapAnchor& a) {
  out.put(a.keyframe.value);
  out.put(a.measured.p_B);
  out.put(a.measured.T_AB);
  put_information(out, a.measured.information);
}

MapAnchor get_anchor(BytesIn& in) {
  MapAnchor a;
  a.keyframe.value = in.get<std::int64_t>();
  a.measured.p_B = in.vec3();
  a.measured.T_AB = in.pose<Pose<A, B>>();
  a.measured.information = get_information(in);
  in.check(a.measured.information.allFinite() && is_information(a.measured.information));
  return a;
}

void put_tag(BytesOut& out, const MapTag& t) {
  out.put(t.keyframe.value);
  out.put(static_cast<std::int32_t>(t.id));
  out.put(t.T_BT);
  put_information(out, t.covariance);
}

MapTag get_tag(BytesIn& in) {
  MapTag t;
  t.keyframe.value = in.get<std::int64_t>();
  t.id = in.get<std::int32_t>();
  t.T_BT = in.pose<Pose<B, Tag>>();
  t.covariance = get_information(in);
  in.check(t.covariance.allFinite() && is_positive_definite(t.covariance));
  return t;
}

std::string get_name(BytesIn& in) {
  const auto n = in.get<std::uint32_t>();
  in.check(n > 0 && n <= kLongestName && n <= in.left());
  std::string name(in.ok() ? n : 0, '\0');
  in.raw(name.data(), name.size());
  return name;
}

void get_cameras(BytesIn& in, PlaceMap& map) {
  const auto further = in.get<std::uint32_t>();
  in.check(further > 0 && further <= kMostFurtherCameras);
  map.cameras.resize(1);
  for (std::uint32_t i = 0; i < further && in.ok(); ++i) map.cameras.push_back(in.pose<Pose<B, C0>>());
  for (MapKeyframe& k : map.keyframes()) {
    const auto camera = in.get<std::uint16_t>();
    in.check(camera < map.cameras.size());
    if (in.ok()) k.camera = camera;
  }
}

/// Sessions that have a place in M, and those of which no keyframe is left.
std::vector<MapSession> remembered(const PlaceMap& map) {
  std::set<std::uint32_t> placed, unplaced;
  for (const MapKeyframe& k : map.keyframes()) (k.placed ? placed : unplaced).insert(k.session);
  std::vector<MapSession> out;
  for (const MapSession& s : map.sessions)
    if (placed.count(s.number) > 0 || unplaced.count(s.number) == 0) out.push_back(s);
  return out;
}

bool have_scales(const std::vector<MapSession>& sessions) {
  return std::ranges::any_of(sessions, [](const MapSession& s) { return s.scale_sigma > 0; });
}

void put_sessions(BytesOut& out, const std::vector<MapSession>& sessions) {
  const bool scales = have_scales(sessions);
  out.put(static_cast<std::uint32_t>(sessions.size()));
  for (const MapSession& s : sessions) {
    out.put(s.number);
    out.put(s.began.ns);
    out.put(s.ended.ns);
    out.put(static_cast<std::int32_t>(s.keyframes));
    out.put(static_cast<std::int32_t>(s.loops));
    if (scales) out.put(s.scale_sigma), out.put(s.log_scale);
  }
}

void get_sessions(BytesIn& in, bool scales, PlaceMap& map) {
  const auto sessions = in.get<std::uint32_t>();
  in.check(sessions > (scales ? 0 : 1));
  for (std::uint32_t i = 0; i < sessions && in.ok(); ++i) {
    MapSession s;
    s.number = in.get<std::uint32_t>();
    s.began.ns = in.get<std::int64_t>();
    s.ended.ns = in.get<std::int64_t>();
    s.keyframes = in.get<std::int32_t>();
    s.loops = in.get<std::int32_t>();
    if (scales) s.scale_sigma = in.get<double>(), s.log_scale = in.get<double>();
    in.check(s.scale_sigma >= 0 && s.scale_sigma < kLargestScale && std::abs(s.log_scale) < kLargestScale);
    in.check(map.sessions.empty() || s.number > map.sessions.back().number);
    map.sessions.push_back(s);
  }
}

}  // namespace

Error damaged_map(const std::string& name, std::string_view what) {
  return {ErrorCode::malformed, fmt::format("{}: damaged map: {}", name, what)};
}

std::uint64_t map_checksum(std::string_view bytes) { return checksum64(std::as_bytes(std::span(bytes))); }

void put_keyframe(BytesOut& out, const MapKeyframe& k, std::uint32_t features) {
  out.put(k.id.value);
  out.put(k.t.ns);
  out.put(k.session);
  out.put(static_cast<std::int32_t>(k.loops_ending_here));
  out.put(k.T_GB);
  out.put(k.T_MB);
  out.put(k.path_m);
  out.put(k.place.up_C0);
  out.put(k.place.focal_px);
  out.put(features);
}

MapKeyframe get_keyframe(BytesIn& in, std::uint32_t& features) {
  MapKeyframe k;
  k.id.value = in.get<std::int64_t>();
  k.t.ns = in.get<std::int64_t>();
  k.session = in.get<std::uint32_t>();
  k.loops_ending_here = in.get<std::int32_t>();
  k.T_GB = in.pose<Pose<G, B>>();
  k.T_MB = in.pose<Pose<M, B>>();
  k.path_m = in.get<double>();
  k.place.up_C0 = in.vec3();
  k.place.focal_px = in.get<double>();
  in.check(k.place.focal_px > 1 && k.place.focal_px < 1e6);
  features = in.get<std::uint32_t>();
  return k;
}

void put_words(BytesOut& out, const BowVector& words) { out.raw(words.data(), words.size() * sizeof(BowEntry)); }

void get_words(BytesIn& in, std::uint32_t count, BowVector& words) {
  in.check(count <= in.left() / sizeof(BowEntry));
  if (!in.ok()) return;
  words.resize(count);
  in.raw(words.data(), count * sizeof(BowEntry));
  std::int64_t last = -1;
  for (const BowEntry& e : words) {
    in.check(e.word > last && std::isfinite(e.weight) && e.weight >= 0);
    last = e.word;
  }
}

void put_place(BytesOut& out, const Place& place) {
  out.raw(place.features.data(), place.features.size() * sizeof(PlaceFeature));
  out.raw(place.descriptors.data(), place.descriptors.size() * sizeof(Descriptor));
}

void get_place(BytesIn& in, std::uint32_t features, Place& place) {
  in.check(features <= in.left() / kFeatureBytes);
  if (!in.ok()) return;
  place.features.resize(features);
  place.descriptors.resize(features);
  in.raw(place.features.data(), features * sizeof(PlaceFeature));
  in.raw(place.descriptors.data(), features * sizeof(Descriptor));
  for (const PlaceFeature& f : place.features)
    in.check(std::isfinite(f.x) && std::isfinite(f.y) && std::isfinite(f.inverse_depth) && f.sigma_xy > 0 &&
             std::isfinite(f.sigma_inverse_depth));
}

MapRest rest_of(const PlaceMap& map) {
  MapRest rest;
  std::set<KeyframeId> kept;
  for (const MapKeyframe& k : map.keyframes())
    if (k.placed) kept.insert(kept.end(), k.id);
  for (const MapEdge& e : map.edges)
    if (kept.count(e.from) > 0 && kept.count(e.to) > 0) rest.edges.push_back(&e);
  rest.name = map.name.substr(0, kLongestName);
  for (const MapAnchor& a : map.anchors)
    if (kept.count(a.keyframe) > 0) rest.anchors.push_back(&a);
  for (const MapTag& t : map.tags)
    if (kept.count(t.keyframe) > 0) rest.tags.push_back(&t);
  rest.cameras.assign(map.cameras.begin() + 1, map.cameras.end());
  for (const MapKeyframe& k : map.keyframes())
    if (k.placed) rest.seen_by.push_back(k.camera);
  if (std::ranges::all_of(rest.seen_by, [](std::uint16_t camera) { return camera == 0; }))
    rest.cameras.clear(), rest.seen_by.clear();
  rest.sessions = remembered(map);
  if (rest.sessions.size() == 1 && !have_scales(rest.sessions)) rest.sessions.clear();
  return rest;
}

std::uint32_t flags_of(const PlaceMap& map, const MapRest& rest) {
  return (map.boosted ? kMapBoosted : 0) | (rest.name.empty() ? 0 : kMapNamed) | (rest.anchors.empty() ? 0 : kMapAnchors) |
         (map.anchored ? kMapAnchored : 0) | (rest.sessions.empty() ? 0 : kMapMemory) | (rest.tags.empty() ? 0 : kMapTags) |
         (have_scales(rest.sessions) ? kMapScales : 0) | (rest.cameras.empty() ? 0 : kMapCameras);
}

void put_rest(BytesOut& out, const MapRest& rest) {
  for (const MapEdge* e : rest.edges) put_edge(out, *e);
  if (!rest.name.empty()) {
    out.put(static_cast<std::uint32_t>(rest.name.size()));
    out.raw(rest.name.data(), rest.name.size());
  }
  if (!rest.anchors.empty()) {
    out.put(static_cast<std::uint32_t>(rest.anchors.size()));
    for (const MapAnchor* a : rest.anchors) put_anchor(out, *a);
  }
  if (!rest.sessions.empty()) put_sessions(out, rest.sessions);
  if (!rest.tags.empty()) {
    out.put(static_cast<std::uint32_t>(rest.tags.size()));
    for (const MapTag* t : rest.tags) put_tag(out, *t);
  }
  if (rest.cameras.empty()) return;
  out.put(static_cast<std::uint32_t>(rest.cameras.size()));
  for (const Pose<B, C0>& T_BC : rest.cameras) out.put(T_BC);
  for (const std::uint16_t camera : rest.seen_by) out.put(camera);
}

void put_missed(BytesOut& out, const PlaceMap& map) {
  for (const MapKeyframe& k : map.keyframes())
    if (k.placed) out.put(static_cast<std::int32_t>(k.missed));
}

void get_rest(BytesIn& in, std::uint32_t edges, std::uint32_t flags, PlaceMap& map) {
  for (std::uint32_t i = 0; i < edges && in.ok(); ++i) {
    MapEdge e = get_edge(in);
    in.check(map.find(e.from) != nullptr && map.find(e.to) != nullptr && e.from != e.to);
    if (in.ok()) map.edges.push_back(e);
  }
  if (in.ok() && (flags & kMapNamed) != 0) map.name = get_name(in);
  const std::uint32_t anchors = in.ok() && (flags & kMapAnchors) != 0 ? in.get<std::uint32_t>() : 0;
  in.check(anchors > 0 || (flags & kMapAnchors) == 0);
  for (std::uint32_t i = 0; i < anchors && in.ok(); ++i) {
    MapAnchor a = get_anchor(in);
    in.check(map.find(a.keyframe) != nullptr);
    if (in.ok()) map.anchors.push_back(a);
  }
  if (in.ok() && (flags & kMapMemory) != 0) get_sessions(in, (flags & kMapScales) != 0, map);
  const std::uint32_t tags = in.ok() && (flags & kMapTags) != 0 ? in.get<std::uint32_t>() : 0;
  in.check(tags > 0 || (flags & kMapTags) == 0);
  for (std::uint32_t i = 0; i < tags && in.ok(); ++i) {
    MapTag t = get_tag(in);
    in.check(map.find(t.keyframe) != nullptr);
    if (in.ok()) map.tags.push_back(t);
  }
  if (in.ok() && (flags & kMapCameras) != 0) get_cameras(in, map);
}

void get_missed(BytesIn& in, std::uint32_t flags, PlaceMap& map) {
  if (!in.ok() || (flags & kMapMemory) == 0) return;
  for (MapKeyframe& k : map.keyframes()) k.missed = in.get<std::int32_t>();
}

}  // namespace fbvins
