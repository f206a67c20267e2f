// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/kalibr_imu.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <vector>

#include "fbvins/camera/check_rig.hpp"
#include "fbvins/io/calibration.hpp"
#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/file_source.hpp"

namespace fbvins {
namespace {

constexpr int kMostImus = 8;

/// Where an IMU is, by the fields that Kalibr writes beside its noise.
struct ImuPlace {
  std::string name, topic;
  Pose<B, B> T_IB;  ///< from Kalibr's body
  double time_offset_s = 0;
};

ImuPlace read_place(YamlReader& yaml, const YAML::Node& map, const std::string& name) {
  ImuPlace out{name, yaml.has(map, "rostopic") ? yaml.text(map, "rostopic") : "", {}, 0};
  if (yaml.has(map, "T_i_b")) out.T_IB = read_transform<B, B>(yaml, map, "T_i_b");
  if (yaml.has(map, "time_offset")) out.time_offset_s = yaml.number_between(map, "time_offset", -10, 10, 0);
  return out;
}

bool same(const ImuPlace& a, const ImuPlace& b) {
  constexpr double kSame_m = 1e-9, kSame_s = 1e-9;
  return (a.T_IB.p - b.T_IB.p).norm() < kSame_m && (a.T_IB.q.conjugate() * b.T_IB.q).vec().norm() < kSame_m &&
         std::abs(a.time_offset_s - b.time_offset_s) < kSame_s;
}

/// The one that was asked for; without that the only one, or the first of those in one place.
std::optional<ImuPlace> chosen(YamlReader& yaml, const std::string& which) {
  const YAML::Node& root = yaml.root();
  std::vector<ImuPlace> all;
  for (int i = 0; i < kMostImus; ++i)
    if (const std::string name = fmt::format("imu{}", i); yaml.has(root, name))
      all.push_back(read_place(yaml, yaml.get(root, name), name));
  if (all.empty()) all.push_back(read_place(yaml, root, ""));
  if (!yaml.ok()) return std::nullopt;
  if (!which.empty()) {
    const auto found = std::ranges::find(all, which, &ImuPlace::name);
    if (found != all.end()) return *found;
    yaml.complain(root, which, "is not there");
    return std::nullopt;
  }
  if (std::ranges::all_of(all, [&](const ImuPlace& imu) { return same(imu, all.front()); })) return all.front();
  std::vector<std::string> named;
  for (const ImuPlace& imu : all) named.push_back(imu.topic.empty() ? imu.name : fmt::format("{} ({})", imu.name, imu.topic));
  yaml.complain(root, "imu",
                fmt::format("there are several in different places, {}: say which one was recorded by a name behind the file's, "
                            "--imu-calibration {}:{}",
                            fmt::join(named, " and "), yaml.file(), all.back().name));
  return std::nullopt;
}

StereoRig seen_from(const StereoRig& rig, const ImuPlace& imu) {
  StereoRig out = rig;
  const Pose<B, B>& T = imu.T_IB;
  for (MountedCamera& camera : out.cameras) camera.T_BC = T * camera.T_BC;
  if (out.depth && out.depth->own) out.depth->own->T_BC = T * out.depth->own->T_BC;
  out.time_offset_s = rig.time_offset_s - imu.time_offset_s;
  return out;
}

}  // namespace

Result<StereoRig> with_imu_text(const StereoRig& rig, const std::string& file, const std::string& text,
                                const std::string& which) {
  YamlReader yaml(file, text);
  if (!yaml.ok()) return yaml.error();
  const std::optional<ImuPlace> imu = chosen(yaml, which);
  if (!imu) return yaml.error();
  const Result<ImuNoise> noise = parse_imu({file, text}, rig.imu_noise, imu->name.empty() ? "imu0" : imu->name);
  if (!noise) return noise.error();
  StereoRig out = same(*imu, {}) ? rig : seen_from(rig, *imu);
  out.imu_noise = *noise;
  if (Result<void> good = check_rig(out, file); !good) return good.error();
  return out;
}

Result<StereoRig> with_imu_file(const StereoRig& rig, const std::string& name) {
  std::string path = name, which;
  std::error_code ignored;
  if (const std::size_t at = name.rfind(":imu"); at != std::string::npos && !std::filesystem::exists(name, ignored))
    path = name.substr(0, at), which = name.substr(at + 1);
  const Result<std::string> text = read_file(path, kLargestYaml_bytes);
  if (!text) return text.error();
  return with_imu_text(rig, path, *text, which);
}

std::vector<std::string> topics_of_imus(const std::string& path) {
  const Result<std::string> text = read_file(path, kLargestYaml_bytes);
  YamlReader yaml(path, text ? *text : "");
  std::vector<std::string> out;
  for (int i = 0; text && i < kMostImus; ++i) {
    const std::string imu = fmt::format("imu{}", i);
    if (!yaml.has(yaml.root(), imu)) break;
    out.push_back(read_place(yaml, yaml.get(yaml.root(), imu), imu).topic);
  }
  return out.size() > 1 ? out : std::vector<std::string>{};
}

std::string imu_of_topics(const std::string& path, const std::vector<std::string>& recorded) {
  const std::vector<std::string> topics = topics_of_imus(path);
  const auto is_recorded = [&](const std::string& topic) { return std::ranges::find(recorded, topic) != recorded.end(); };
  if (std::ranges::count_if(topics, is_recorded) != 1) return path;
  return fmt::format("{}:imu{}", path, std::ranges::find_if(topics, is_recorded) - topics.begin());
}

}  // namespace fbvins
