// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "fbvins/core/atomic_file.hpp"
#include "fbvins/loop/map_front.hpp"
#include "fbvins/loop/map_journal.hpp"
#include "fbvins/loop/map_records.hpp"
#include "fbvins/loop/map_sessions.hpp"
#include "fbvins/loop/map_writer.hpp"

namespace fbvins {
namespace {

/// Of files of version 1: header (name, version, flags, length, checksum), keyframes with their places, and the rest.
Result<PlaceMap> parse_version_1(std::string_view bytes, const std::string& name) {
  constexpr std::size_t kHeader = kMapHeaderBytes + 16;
  if (bytes.size() < kHeader) return damaged_map(name, "too short");
  BytesIn head(bytes.substr(kMapName.size() + 4)), in(bytes.substr(kHeader));
  const auto flags = head.get<std::uint32_t>();
  if ((flags & ~kMapFlags) != 0) return damaged_map(name, "unknown flags");
  if (head.get<std::uint64_t>() != bytes.size() - kHeader) return damaged_map(name, "cut short or grown");
  if (head.get<std::uint64_t>() != (map_checksum(bytes.substr(kHeader)) ^ flags))
    return damaged_map(name, "the checksum differs");
  PlaceMap map;
  map.boosted = (flags & kMapBoosted) != 0;
  map.anchored = (flags & kMapAnchored) != 0;
  const auto keyframes = in.get<std::uint32_t>(), edges = in.get<std::uint32_t>();
  map.cameras[0] = in.pose<Pose<B, C0>>();
  KeyframeId last;
  for (std::uint32_t i = 0; i < keyframes && in.ok(); ++i) {
    std::uint32_t features = 0;
    MapKeyframe k = get_keyframe(in, features);
    get_place(in, features, k.place);
    in.check(k.id > last && k.id.value < (std::int64_t{1} << 31));
    last = k.id;
    if (in.ok()) map.add(std::move(k));
  }
  get_rest(in, edges, flags, map);
  get_missed(in, flags, map);
  if (!in.ok() || !in.at_end()) return damaged_map(name, "its content makes no sense");
  remember_sessions(map);
  return map;
}

/// Of any version; places of the newest one stay in the file.
Result<PlaceMap> parsed(std::shared_ptr<ByteSource> file, const std::string& name, std::uint64_t most_bytes) {
  const std::string header = file->read(0, kMapHeaderBytes);
  if (header.size() < kMapHeaderBytes) return damaged_map(name, "too short");
  if (!header.starts_with(kMapName)) return Error{ErrorCode::unsupported, fmt::format("{}: not a map", name)};
  const auto version = BytesIn(std::string_view(header).substr(kMapName.size())).get<std::uint32_t>();
  if (version == 1) return parse_version_1(file->read(0, file->size()), name);
  if (version == kMapVersion) return read_front(std::move(file), name, most_bytes);
  return Error{ErrorCode::unsupported,
               fmt::format("{}: map of version {}, this program reads 1 and {}", name, version, kMapVersion)};
}

Result<PlaceMap> opened(const std::shared_ptr<ByteSource>& file, const std::string& name, std::uint64_t most_bytes) {
  Result<PlaceMap> map = parsed(file, name, most_bytes);
  if (map) map->base = base_of(*map, *file);
  return map;
}

}  // namespace

Result<std::string> map_bytes(const PlaceMap& map) {
  std::string bytes;
  if (Result<void> written = write_map(map, [&](std::string_view piece) { bytes += piece; }); !written) return written.error();
  return bytes;
}

std::string serialise_map(const PlaceMap& map) {
  Result<std::string> bytes = map_bytes(map);
  return bytes ? *std::move(bytes) : std::string();
}

Result<PlaceMap> parse_map(std::span<const std::byte> bytes, const std::string& name) {
  const std::string_view view(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return read_whole(opened(bytes_in_memory(std::string(view)), name, 0), name);
}

Result<void> save_map(const PlaceMap& map, const std::string& path) {
  Result<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  if (Result<void> written = write_map(map, [&](std::string_view piece) { file->write(piece); }); !written) return written;
  if (Result<void> done = file->commit(); !done) return done;
  remove_journal(path);
  return {};
}

Result<void> write_map_bytes(const std::string& path, std::string_view bytes) {
  if (!bytes.starts_with(kMapName)) return write_journal(path, bytes);
  if (Result<void> done = write_file_atomically(path, bytes); !done) return done;
  remove_journal(path);
  return {};
}

Result<PlaceMap> open_map(const std::string& path, std::uint64_t most_bytes) {
  auto file = open_bytes(path);
  if (!file) return file.error();
  return with_journal(opened(*file, path, most_bytes), path);
}

Result<PlaceMap> load_map(const std::string& path) {
  auto file = open_bytes(path);
  if (!file) return file.error();
  return with_journal(read_whole(opened(*file, path, 0), path), path);
}

std::string map_as_ply(const PlaceMap& map) {
  constexpr float kMaxRelativeSigma = 0.1f;  // of a depth worth looking at
  std::string points;
  std::size_t count = 0;
  for (const MapKeyframe& k : map.keyframes()) {
    const Pose<M, C0> T_MC = map.T_MC(k);
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
