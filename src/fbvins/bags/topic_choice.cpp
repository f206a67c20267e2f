// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/topic_choice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <span>

#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

constexpr const char* kCameraOption = "CAM0,CAM1,...[,IMU]";

template <class Map>
std::vector<std::string> names(const Map& map) {
  std::vector<std::string> out;
  for (const auto& [name, value] : map) out.push_back(name);
  return out;
}

/// The topic named, or an error that lists those there are.
template <class Map>
Result<std::string> named_topic(const Map& map, const std::string& name, const char* what) {
  if (map.contains(name)) return name;
  return Error{ErrorCode::not_found, fmt::format("there is no {} on '{}'; there are {}", what, name,
                                                 printable(fmt::format("{}", fmt::join(names(map), ", "))))};
}

using Words = std::pair<const char*, const char*>;
constexpr Words kCameras[] = {{"left", "right"},      {"cam0", "cam1"},    {"infra1", "infra2"}, {"Infrared_1", "Infrared_2"},
                              {"camera0", "camera1"}, {"image0", "image1"}};
constexpr Words kMotion[] = {{"Gyro", "Accel"}, {"gyro", "accel"}};

/// The name that differs from `topic` in these words only; empty where there is none.
std::string partner_by_words(const std::string& topic, const std::vector<std::string>& topics, std::span<const Words> all) {
  for (const auto& [one, other] : all) {
    const std::size_t at = topic.find(one);
    if (at == std::string::npos) continue;
    std::string partner = topic;
    partner.replace(at, std::string_view(one).size(), other);
    if (std::find(topics.begin(), topics.end(), partner) != topics.end()) return partner;
  }
  return "";
}

using TopicPair = std::pair<std::string, std::string>;

/// All that differ in left and right only, each once.
std::vector<TopicPair> pairs_by_words(const std::vector<std::string>& topics, std::span<const Words> all) {
  std::vector<TopicPair> out;
  for (const Words& words : all)
    for (const std::string& topic : topics)
      if (const std::string partner = partner_by_words(topic, topics, {&words, 1}); !partner.empty())
        if (const TopicPair pair(topic, partner); std::find(out.begin(), out.end(), pair) == out.end()) out.push_back(pair);
  return out;
}

/// Without those that are the same images compressed.
std::vector<std::string> image_topics(const BagContents& contents) {
  std::vector<std::string> out = names(contents.images);
  std::erase_if(out, [&](const std::string& topic) {
    constexpr std::string_view kCompressed = "/compressed";
    return topic.ends_with(kCompressed) && contents.images.contains(topic.substr(0, topic.size() - kCompressed.size()));
  });
  return out;
}

std::string listed(const std::vector<std::string>& topics) { return printable(fmt::format("{}", fmt::join(topics, ", "))); }

Result<TopicPair> find_images(const BagContents& contents) {
  const std::vector<std::string> all = image_topics(contents);
  if (all.size() < 2)
    return Error{ErrorCode::unsupported, fmt::format("holds images on {} topics{}, not on two", all.size(),
                                                     all.empty() ? "" : fmt::format(" ({})", listed(all)))};
  const std::vector<TopicPair> pairs = pairs_by_words(all, kCameras);
  if (pairs.size() == 1) return pairs.front();
  if (pairs.empty() && all.size() == 2) return std::pair(all[0], all[1]);
  if (pairs.empty())
    return Error{
        ErrorCode::unsupported,
        fmt::format("has {} image topics ({}): say which are left and right with --topics LEFT,RIGHT", all.size(), listed(all))};
  std::vector<std::string> each;
  for (const auto& [left, right] : pairs) each.push_back(left + " and " + right);
  return Error{ErrorCode::unsupported,
               fmt::format("has {} stereo pairs ({}): say which with --topics LEFT,RIGHT", pairs.size(), listed(each))};
}

/// `option`: how the command line names all topics.
Result<std::string> find_imu(const BagContents& contents, const char* option) {
  const std::vector<std::string> all = names(contents.imu);
  if (all.empty()) return Error{ErrorCode::not_found, "holds no IMU readings"};
  if (all.size() == 1) return all.front();
  if (const auto pairs = pairs_by_words(all, kMotion); pairs.size() == 1 && all.size() == 2) return pairs.front().first;
  return Error{ErrorCode::unsupported,
               fmt::format("has {} IMU topics ({}): say which it is with --topics {}", all.size(), listed(all), option)};
}

std::string accelerometer_of(const BagContents& contents, const std::string& gyroscope) {
  return partner_by_words(gyroscope, names(contents.imu), kMotion);
}

/// Of /cam0/image_raw /cam0: topics of one camera in different forms have it in common.
std::string camera_folder(const std::string& topic) {
  constexpr std::string_view kCompressed = "/compressed";
  const std::string plain = topic.ends_with(kCompressed) ? topic.substr(0, topic.size() - kCompressed.size()) : topic;
  const std::size_t slash = plain.rfind('/');
  return slash != std::string::npos && plain.compare(slash + 1, 5, "image") == 0 ? plain.substr(0, slash) : plain;
}

Result<std::vector<std::string>> find_cameras(const BagContents& contents) {
  std::vector<std::string> all = image_topics(contents);
  std::erase_if(all, [](const std::string& topic) { return topic.find("depth") != std::string::npos; });
  if (all.empty()) return Error{ErrorCode::not_found, "holds no images"};
  const auto ask = [&](const std::string& what) {
    return Error{ErrorCode::unsupported,
                 fmt::format("{} ({}): say which are the cameras' with --topics {}", what, listed(all), kCameraOption)};
  };
  if (std::ssize(all) > kMostCameras) return ask(fmt::format("has {} image topics, more than {}", all.size(), kMostCameras));
  for (std::size_t i = 1; i < all.size(); ++i)
    if (camera_folder(all[i]) == camera_folder(all[i - 1])) return ask("has several image topics of one camera");
  return all;
}

}  // namespace

Result<ChosenTopics> choose_topics(const BagContents& contents, const ChosenTopics& named, bool imu_needed) {
  ChosenTopics out;
  if (named.left.empty() != named.right.empty())
    return Error{ErrorCode::invalid_argument, "one image topic is named and the other is not"};
  if (!named.left.empty()) {
    const auto left = named_topic(contents.images, named.left, "image"),
               right = named_topic(contents.images, named.right, "image");
    if (!left) return left.error();
    if (!right) return right.error();
    out.left = *left, out.right = *right;
  } else {
    const auto images = find_images(contents);
    if (!images) return images.error();
    out.left = images->first, out.right = images->second;
  }
  const auto imu = named.imu.empty() ? find_imu(contents, "LEFT,RIGHT,IMU") : named_topic(contents.imu, named.imu, "IMU");
  if (imu) {
    out.imu = *imu;
    out.accel = accelerometer_of(contents, *imu);
  } else if (imu_needed || !contents.imu.empty()) return imu.error();
  return out;
}

Result<CameraTopics> choose_cameras(const BagContents& contents, const std::vector<std::string>& named) {
  CameraTopics out;
  for (const std::string& topic : named) {
    if (contents.images.contains(topic)) {
      out.cameras.push_back(topic);
    } else if (contents.imu.contains(topic)) {
      if (!out.imu.empty()) return Error{ErrorCode::invalid_argument, "--topics names two IMUs"};
      out.imu = topic;
    } else {
      return Error{ErrorCode::not_found,
                   fmt::format("there are neither images nor IMU readings on '{}'; there are images on {}, "
                               "readings on {}",
                               printable(topic), listed(names(contents.images)), listed(names(contents.imu)))};
    }
  }
  if (std::ssize(out.cameras) > kMostCameras)
    return Error{ErrorCode::invalid_argument, fmt::format("--topics names more than {} cameras", kMostCameras)};
  if (out.cameras.empty()) {
    Result<std::vector<std::string>> found = find_cameras(contents);
    if (!found) return found.error();
    out.cameras = *std::move(found);
  }
  if (out.imu.empty() && !contents.imu.empty()) {
    const Result<std::string> imu = find_imu(contents, kCameraOption);
    if (!imu) return imu.error();
    out.imu = *imu;
  }
  if (!out.imu.empty()) out.accel = accelerometer_of(contents, out.imu);
  return out;
}

}  // namespace fbvins
