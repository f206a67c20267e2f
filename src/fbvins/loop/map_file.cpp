// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_file.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <set>

#include "fbvins/core/atomic_file.hpp"
#include "fbvins/loop/binary_file.hpp"
#include "fbvins/loop/map_sessions.hpp"

namespace fbvins {
namespace {

constexpr char kMagic[8] = {'F', 'B', 'V', 'P', 'L', 'A', 'C', 'E'};
constexpr std::size_t kHeaderBytes = 32;
constexpr std::size_t kFeatureBytes = sizeof(PlaceFeature), kDescriptorBytes = sizeof(Descriptor);
static_assert(kFeatureBytes == 20 && kDescriptorBytes == 32);

/// Little-endian, as every machine this runs on.
class Writer {
 public:
  template <class T>
  void put(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void put(const Vec3& v) {
    for (int i = 0; i < 3; ++i) put(v[i]);
  }
  void put(const Quat& q) {
    for (const double c : {q.w(), q.x(), q.y(), q.z()}) put(c);
  }
  template <class A, class Z>
  void put(const Pose<A, Z>& T) {
    put(T.q);
    put(T.p);
  }
  void raw(const void* data, std::size_t n) { bytes_.append(static_cast<const char*>(data), n); }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : rest_(bytes) {}

  bool ok() const { return ok_; }
  bool at_end() const { return rest_.empty(); }
  std::size_t left() const { return rest_.size(); }
  template <class T>
  T get() {
    T value{};
    raw(&value, sizeof value);
    return value;
  }
  void raw(void* out, std::size_t n) {
    if (n > rest_.size()) {
      ok_ = false;
      return;
    }
    if (n == 0) return;  // an empty vector has no address to copy to
    std::memcpy(out, rest_.data(), n);
    rest_ = rest_.subspan(n);
  }
  Vec3 vec3() {
    Vec3 v;
    for (int i = 0; i < 3; ++i) v[i] = get<double>();
    check(v.allFinite());
    return v;
  }
  template <class P>
  P pose() {
    const double w = get<double>(), x = get<double>(), y = get<double>(), z = get<double>();
    const Quat q(w, x, y, z);
    check(std::abs(q.squaredNorm() - 1) < 1e-6);  // false for NaN
    return P(q, vec3());
  }
  void check(bool good) { ok_ = ok_ && good; }

 private:
  std::span<const std::byte> rest_;
  bool ok_ = true;
};

void put(Writer& w, const MapKeyframe& k) {
  w.put(k.id.value);
  w.put(k.t.ns);
  w.put(k.session);
  w.put(static_cast<std::int32_t>(k.loops_ending_here));
  w.put(k.T_GB);
  w.put(k.T_MB);
  w.put(k.path_m);
  w.put(k.place.up_C0);
  w.put(k.place.focal_px);
  w.put(static_cast<std::uint32_t>(k.place.size()));
  w.raw(k.place.features.data(), k.place.size() * kFeatureBytes);
  w.raw(k.place.descriptors.data(), k.place.size() * kDescriptorBytes);
}

MapKeyframe get_keyframe(Reader& r) {
  MapKeyframe k;
  k.id.value = r.get<std::int64_t>();
  k.t.ns = r.get<std::int64_t>();
  k.session = r.get<std::uint32_t>();
  k.loops_ending_here = r.get<std::int32_t>();
  k.T_GB = r.pose<Pose<G, B>>();
  k.T_MB = r.pose<Pose<M, B>>();
  k.path_m = r.get<double>();
  k.place.up_C0 = r.vec3();
  k.place.focal_px = r.get<double>();
  r.check(k.place.focal_px > 1 && k.place.focal_px < 1e6);
  const auto n = r.get<std::uint32_t>();
  if (n > r.left() / (kFeatureBytes + kDescriptorBytes)) {
    r.check(false);
    return k;
  }
  k.place.features.resize(n);
  k.place.descriptors.resize(n);
  r.raw(k.place.features.data(), n * kFeatureBytes);
  r.raw(k.place.descriptors.data(), n * kDescriptorBytes);
  for (const PlaceFeature& f : k.place.features)
    r.check(std::isfinite(f.x) && std::isfinite(f.y) && std::isfinite(f.inverse_depth) && f.sigma_xy > 0 &&
            std::isfinite(f.sigma_inverse_depth));
  return k;
}

void put_information(Writer& w, const Mat6& information) {
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) w.put(information(i, j));
}

Mat6 get_information(Reader& r) {
  Mat6 information;
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) information(i, j) = information(j, i) = r.get<double>();
  return information;
}

void put(Writer& w, const MapEdge& e) {
  w.put(e.from.value);
  w.put(e.to.value);
  w.put(static_cast<std::uint32_t>(e.kind));
  w.put(e.T_from_to);
  put_information(w, e.information);
}

MapEdge get_edge(Reader& r) {
  MapEdge e;
  e.from.value = r.get<std::int64_t>();
  e.to.value = r.get<std::int64_t>();
  const auto kind = r.get<std::uint32_t>();
  r.check(kind <= 1);
  e.kind = static_cast<MapEdge::Kind>(kind);
  e.T_from_to = r.pose<Pose<B, B>>();
  e.information = get_information(r);
  // The pose graph takes roots of it.
  r.check(e.information.allFinite() && Eigen::LLT<Mat6>(e.information).info() == Eigen::Success);
  return e;
}

void put(Writer& w, const MapAnchor& a) {
  w.put(a.keyframe.value);
  w.put(a.measured.p_B);
  w.put(a.measured.T_AB);
  put_information(w, a.measured.information);
}

MapAnchor get_anchor(Reader& r) {
  MapAnchor a;
  a.keyframe.value = r.get<std::int64_t>();
  a.measured.p_B = r.vec3();
  a.measured.T_AB = r.pose<Pose<A, B>>();
  a.measured.information = get_information(r);
  r.check(a.measured.information.allFinite() && is_information(a.measured.information));
  return a;
}

/// Flags, which the checksum covers: descriptors are boosted; a name follows the edges, and anchors follow it; M is their frame;
/// what is remembered of sessions comes last.
constexpr std::uint32_t kBoosted = 1, kNamed = 2, kAnchors = 4, kAnchored = 8, kMemory = 16;
constexpr std::size_t kLongestName = 200;

std::string get_name(Reader& r) {
  const auto n = r.get<std::uint32_t>();
  r.check(n > 0 && n <= kLongestName && n <= r.left());
  std::string name(r.ok() ? n : 0, '\0');
  r.raw(name.data(), name.size());
  return name;
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

void put_memory(Writer& w, const PlaceMap& map, const std::vector<MapSession>& sessions) {
  w.put(static_cast<std::uint32_t>(sessions.size()));
  for (const MapSession& s : sessions) {
    w.put(s.number);
    w.put(s.began.ns);
    w.put(s.ended.ns);
    w.put(static_cast<std::int32_t>(s.keyframes));
    w.put(static_cast<std::int32_t>(s.loops));
  }
  for (const MapKeyframe& k : map.keyframes())
    if (k.placed) w.put(static_cast<std::int32_t>(k.missed));
}

void get_memory(Reader& r, PlaceMap& map) {
  const auto sessions = r.get<std::uint32_t>();
  r.check(sessions > 1);
  for (std::uint32_t i = 0; i < sessions && r.ok(); ++i) {
    MapSession s;
    s.number = r.get<std::uint32_t>();
    s.began.ns = r.get<std::int64_t>();
    s.ended.ns = r.get<std::int64_t>();
    s.keyframes = r.get<std::int32_t>();
    s.loops = r.get<std::int32_t>();
    r.check(map.sessions.empty() || s.number > map.sessions.back().number);
    map.sessions.push_back(s);
  }
  for (MapKeyframe& k : map.keyframes()) k.missed = r.get<std::int32_t>();
}

Error damaged(const std::string& name, const char* what) {
  return {ErrorCode::malformed, fmt::format("{}: damaged map: {}", name, what)};
}

}  // namespace

std::string serialise_map(const PlaceMap& map) {
  Writer body;
  std::set<KeyframeId> kept;
  for (const MapKeyframe& k : map.keyframes())
    if (k.placed) kept.insert(k.id);
  std::vector<const MapEdge*> edges;
  for (const MapEdge& e : map.edges)
    if (kept.count(e.from) > 0 && kept.count(e.to) > 0) edges.push_back(&e);
  body.put(static_cast<std::uint32_t>(kept.size()));
  body.put(static_cast<std::uint32_t>(edges.size()));
  body.put(map.T_BC0);
  for (const MapKeyframe& k : map.keyframes())
    if (k.placed) put(body, k);
  for (const MapEdge* e : edges) put(body, *e);
  const std::string name = map.name.substr(0, kLongestName);
  if (!name.empty()) {
    body.put(static_cast<std::uint32_t>(name.size()));
    body.raw(name.data(), name.size());
  }
  std::vector<const MapAnchor*> anchors;
  for (const MapAnchor& a : map.anchors)
    if (kept.count(a.keyframe) > 0) anchors.push_back(&a);
  if (!anchors.empty()) {
    body.put(static_cast<std::uint32_t>(anchors.size()));
    for (const MapAnchor* a : anchors) put(body, *a);
  }
  const std::vector<MapSession> sessions = remembered(map);
  const bool memory = sessions.size() > 1;
  if (memory) put_memory(body, map, sessions);
  const std::string bytes = body.take();
  Writer head;
  head.raw(kMagic, sizeof kMagic);
  head.put(kMapVersion);
  const std::uint32_t flags = (map.boosted ? kBoosted : 0) | (name.empty() ? 0 : kNamed) | (anchors.empty() ? 0 : kAnchors) |
                              (map.anchored ? kAnchored : 0) | (memory ? kMemory : 0);
  head.put(flags);
  head.put(static_cast<std::uint64_t>(bytes.size()));
  head.put(checksum64(std::as_bytes(std::span(bytes))) ^ flags);
  return head.take() + bytes;
}

Result<PlaceMap> parse_map(std::span<const std::byte> bytes, const std::string& name) {
  if (bytes.size() < kHeaderBytes) return damaged(name, "too short");
  Reader head(bytes.first(kHeaderBytes));
  char magic[8];
  head.raw(magic, sizeof magic);
  if (std::memcmp(magic, kMagic, sizeof magic) != 0) return Error{ErrorCode::unsupported, fmt::format("{}: not a map", name)};
  const auto version = head.get<std::uint32_t>();
  if (version != kMapVersion)
    return Error{ErrorCode::unsupported, fmt::format("{}: map of version {}, this program reads {}", name, version, kMapVersion)};
  const auto flags = head.get<std::uint32_t>();
  if ((flags & ~(kBoosted | kNamed | kAnchors | kAnchored | kMemory)) != 0) return damaged(name, "unknown flags");
  if (head.get<std::uint64_t>() != bytes.size() - kHeaderBytes) return damaged(name, "cut short or grown");
  if (head.get<std::uint64_t>() != (checksum64(bytes.subspan(kHeaderBytes)) ^ flags))
    return damaged(name, "the checksum differs");

  Reader r(bytes.subspan(kHeaderBytes));
  PlaceMap map;
  map.boosted = (flags & kBoosted) != 0;
  map.anchored = (flags & kAnchored) != 0;
  const auto keyframes = r.get<std::uint32_t>(), edges = r.get<std::uint32_t>();
  map.T_BC0 = r.pose<Pose<B, C0>>();
  KeyframeId last;
  for (std::uint32_t i = 0; i < keyframes && r.ok(); ++i) {
    MapKeyframe k = get_keyframe(r);
    r.check(k.id > last && k.id.value < (std::int64_t{1} << 31));
    last = k.id;
    if (r.ok()) map.add(std::move(k));
  }
  for (std::uint32_t i = 0; i < edges && r.ok(); ++i) {
    MapEdge e = get_edge(r);
    r.check(map.find(e.from) != nullptr && map.find(e.to) != nullptr && e.from != e.to);
    if (r.ok()) map.edges.push_back(e);
  }
  if (r.ok() && (flags & kNamed) != 0) map.name = get_name(r);
  const std::uint32_t anchors = r.ok() && (flags & kAnchors) != 0 ? r.get<std::uint32_t>() : 0;
  for (std::uint32_t i = 0; i < anchors && r.ok(); ++i) {
    MapAnchor a = get_anchor(r);
    r.check(map.find(a.keyframe) != nullptr);
    if (r.ok()) map.anchors.push_back(a);
  }
  if (r.ok() && (flags & kMemory) != 0) get_memory(r, map);
  if (!r.ok() || !r.at_end()) return damaged(name, "its content makes no sense");
  remember_sessions(map);
  return map;
}

Result<void> save_map(const PlaceMap& map, const std::string& path) { return write_file_atomically(path, serialise_map(map)); }

Result<PlaceMap> load_map(const std::string& path) {
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  return parse_map((*file)->bytes(), path);
}

std::string map_as_ply(const PlaceMap& map) {
  constexpr float kMaxRelativeSigma = 0.1f;  // of a depth worth looking at
  std::string points;
  std::size_t count = 0;
  for (const MapKeyframe& k : map.keyframes()) {
    const Pose<M, C0> T_MC = k.T_MB * map.T_BC0;
    for (const PlaceFeature& f : k.place.features) {
      if (!f.has_point() || f.sigma_inverse_depth > kMaxRelativeSigma * f.inverse_depth) continue;
      const Vec3 p = T_MC * f.p_C0();
      const int grey = std::clamp(static_cast<int>(255 * std::min(1.0f, f.inverse_depth)), 40, 255);
      fmt::format_to(std::back_inserter(points), "{:.4f} {:.4f} {:.4f} {} {} {}\n", p.x(), p.y(), p.z(), grey, grey, grey);
      ++count;
    }
  }
  return fmt::format(
             "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
             "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
             count) +
         points;
}

std::string map_as_tum(const PlaceMap& map) {
  std::string lines;
  for (const MapKeyframe& k : map.keyframes())
    fmt::format_to(std::back_inserter(lines), "{}.{:09} {:.6f} {:.6f} {:.6f} {:.8f} {:.8f} {:.8f} {:.8f}\n",
                   k.t.ns / 1'000'000'000, k.t.ns % 1'000'000'000, k.T_MB.p.x(), k.T_MB.p.y(), k.T_MB.p.z(), k.T_MB.q.x(),
                   k.T_MB.q.y(), k.T_MB.q.z(), k.T_MB.q.w());
  return lines;
}

}  // namespace fbvins
