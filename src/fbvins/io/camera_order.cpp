// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/camera_order.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/file_source.hpp"

namespace fbvins {
namespace {

/// Without a slash in front, and without what says only how the images are packed.
std::string_view plain(std::string_view topic) {
  if (topic.starts_with('/')) topic.remove_prefix(1);
  constexpr std::string_view kCompressed = "/compressed";
  if (topic.ends_with(kCompressed)) topic.remove_suffix(kCompressed.size());
  return topic;
}

}  // namespace

bool names_camera(std::string_view rostopic, std::string_view recorded) {
  const std::string_view topic = plain(rostopic), camera = plain(recorded);
  const bool folder = camera.find('/') == std::string_view::npos;
  return topic == camera || (folder && topic.substr(0, topic.find('/')) == camera);
}

std::vector<std::string> rostopics_of(const std::string& camchain_path) {
  const Result<std::string> text = read_file(camchain_path, kLargestYaml_bytes);
  if (!text) return {};
  YamlReader yaml(camchain_path, *text);
  std::vector<std::string> out;
  for (int i = 0; i < kMostCameras; ++i) {
    const YAML::Node camera = yaml.get(yaml.root(), fmt::format("cam{}", i));
    if (!camera.IsDefined()) break;
    out.push_back(camera.IsMap() ? yaml.text(camera, "rostopic") : "");
    if (out.back().empty()) return {};
  }
  return out;
}

std::vector<int> order_by_topics(const std::vector<std::string>& rostopics, const std::vector<std::string>& recorded) {
  std::vector<int> order;
  for (const std::string& camera : recorded) {
    const auto found = std::ranges::find_if(rostopics, [&](const std::string& topic) { return names_camera(topic, camera); });
    const auto number = static_cast<int>(found - rostopics.begin());
    if (found == rostopics.end() || std::ranges::find(order, number) != order.end()) return {};
    order.push_back(number);
  }
  const bool as_numbered = std::ranges::equal(order, [&] {
    std::vector<int> numbers(order.size());
    std::iota(numbers.begin(), numbers.end(), 0);
    return numbers;
  }());
  return as_numbered ? std::vector<int>{} : order;
}

StereoRig in_order(const StereoRig& rig, const std::vector<int>& order) {
  std::vector<MountedCamera> cameras;
  for (const int number : order) cameras.push_back(rig.mounted(number));
  for (int i = 0; i < rig.camera_count(); ++i)
    if (std::ranges::find(order, i) == order.end()) cameras.push_back(rig.mounted(i));
  return with_cameras(rig, cameras);
}

std::string order_sentence(const std::string& camchain_path, const std::vector<int>& order) {
  std::vector<std::string> each;
  for (std::size_t i = 0; i < order.size(); ++i) each.push_back(fmt::format("its cam{} is camera {}", order[i], i));
  return fmt::format("{}: cameras are matched by their rostopic: {}", camchain_path, fmt::join(each, ", "));
}

}  // namespace fbvins
