// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/topic_choice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <span>
#include <utility>

#include "fbvins/io/aiding_messages.hpp"
#include "fbvins/io/quoted.hpp"
#include "fbvins/io/rig_text.hpp"

namespace fbvins {
namespace {

template <class Map>
std::vector<std::string> names(const Map& map) {
  std::vector<std::string> out;
  for (const auto& [name, value] : map) out.push_back(name);
  return out;
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

/// The topics of a pair that is numbered 0 and 1, and of 2, 3 ... as far as they go.
std::vector<std::string> with_further(const TopicPair& pair, const std::vector<std::string>& topics) {
  std::vector<std::string> out{pair.first, pair.second};
  const auto [one, other] = std::ranges::mismatch(pair.first, pair.second);
  if (*one != '0' || *other != '1') return out;
  std::string next = pair.first;
  char& number = next[static_cast<std::size_t>(one - pair.first.begin())];
  for (number = '2'; number < '0' + kMostCameras && std::ranges::find(topics, next) != topics.end(); ++number)
    out.push_back(next);
  return out;
}

/// Of cameras, or of depth images; without those that are the same images compressed.
std::vector<std::string> image_topics(const BagContents& contents, bool depth) {
  std::vector<std::string> out = names(contents.images);
  std::erase_if(out, [&](const std::string& topic) {
    if (names_depth(topic) != depth) return true;
    for (const std::string_view compressed : {"/compressed", "/compressedDepth"})
      if (topic.ends_with(compressed) && contents.images.contains(topic.substr(0, topic.size() - compressed.size()))) return true;
    return false;
  });
  return out;
}

std::string listed(const std::vector<std::string>& topics) { return printable(fmt::format("{}", fmt::join(topics, ", "))); }

Error ask(const std::string& what, const std::vector<std::string>& topics, const char* which) {
  return {ErrorCode::unsupported,
          fmt::format("{} ({}): say which {} with --topics {}", what, listed(topics), which, kTopicsOption)};
}

Error no_images(const BagContents& contents) {
  if (contents.strangers.empty()) return {ErrorCode::unsupported, "holds no images"};
  return {ErrorCode::unsupported, fmt::format("holds no images in messages of ROS; of other messages nothing is read: {}",
                                              listed({contents.strangers.begin(), contents.strangers.end()}))};
}

Result<std::vector<std::string>> find_rig(const BagContents& contents) {
  const std::vector<std::string> all = image_topics(contents, false);
  if (all.empty()) return no_images(contents);
  if (all.size() == 1) return all;
  const std::vector<TopicPair> pairs = pairs_by_words(all, kCameras);
  if (pairs.empty() && all.size() == 2) return all;
  if (pairs.empty()) return ask(fmt::format("has {} image topics", all.size()), all, "are the cameras'");
  if (pairs.size() > 1) {
    std::vector<std::string> each;
    for (const auto& [left, right] : pairs) each.push_back(left + " and " + right);
    return ask(fmt::format("has {} stereo pairs", pairs.size()), each, "are the cameras'");
  }
  return with_further(pairs.front(), all);
}

/// Those that a calibration of ours names, as far as there are images of them.
std::vector<std::string> own_cameras(const BagContents& contents) {
  std::vector<std::string> out = contents.rig.empty() ? std::vector<std::string>{} : topics_in(contents.rig);
  std::erase_if(out, [&](const std::string& topic) { return !contents.images.contains(topic); });
  return out;
}

Result<std::string> find_imu(const BagContents& contents) {
  const std::vector<std::string> all = names(contents.imu);
  if (all.empty()) return Error{ErrorCode::not_found, "holds no IMU readings"};
  if (all.size() == 1) return all.front();
  if (const auto pairs = pairs_by_words(all, kMotion); pairs.size() == 1 && all.size() == 2) return pairs.front().first;
  return ask(fmt::format("has {} IMU topics", all.size()), all, "it is");
}

/// The IMU, where none is named, and the accelerometer beside it.
Result<void> add_imu(const BagContents& contents, bool needed, ChosenTopics& out) {
  if (out.imu.empty()) {
    const Result<std::string> imu = find_imu(contents);
    if (!imu && (needed || !contents.imu.empty())) return imu.error();
    if (imu) out.imu = *imu;
  }
  if (!out.imu.empty()) out.accel = partner_by_words(out.imu, names(contents.imu), kMotion);
  return {};
}

/// Of /cam0/image_raw /cam0: topics of one camera in different forms have it in common.
std::string camera_folder(const std::string& topic) {
  constexpr std::string_view kCompressed = "/compressed";
  const std::string plain = topic.ends_with(kCompressed) ? topic.substr(0, topic.size() - kCompressed.size()) : topic;
  const std::size_t slash = plain.rfind('/');
  return slash != std::string::npos && plain.compare(slash + 1, 5, "image") == 0 ? plain.substr(0, slash) : plain;
}

Result<std::vector<std::string>> find_all_cameras(const BagContents& contents) {
  const std::vector<std::string> all = image_topics(contents, false);
  if (all.empty()) return no_images(contents);
  if (std::ssize(all) > kMostCameras)
    return ask(fmt::format("has {} image topics, more than {}", all.size(), kMostCameras), all, "are the cameras'");
  for (std::size_t i = 1; i < all.size(); ++i)
    if (camera_folder(all[i]) == camera_folder(all[i - 1]))
      return ask("has several image topics of one camera", all, "are the cameras'");
  return all;
}

/// What is named, by what is on it.
Result<ChosenTopics> sorted_by_kind(const BagContents& contents, const std::vector<std::string>& named) {
  ChosenTopics out;
  const auto twice = [](const char* what) {
    return Error{ErrorCode::invalid_argument, fmt::format("--topics names two {}", what)};
  };
  for (const std::string& topic : named) {
    if (contents.images.contains(topic) && !names_depth(topic)) {
      if (std::ranges::find(out.cameras, topic) != out.cameras.end()) return twice("cameras of one name");
      out.cameras.push_back(topic);
    } else if (contents.images.contains(topic)) {
      if (!std::exchange(out.depth, topic).empty()) return twice("depth sensors");
    } else if (contents.imu.contains(topic)) {
      if (!std::exchange(out.imu, topic).empty()) return twice("IMUs");
    } else if (contents.aiding.contains(topic)) {
      if (std::ranges::find(out.aiding, topic) != out.aiding.end()) return twice("sensors of one name");
      out.aiding.push_back(topic);
    } else {
      const std::string aiding =
          contents.aiding.empty() ? "" : fmt::format(", of other sensors on {}", listed(names(contents.aiding)));
      return Error{ErrorCode::not_found,
                   fmt::format("there are neither images nor IMU readings on '{}'; there are images on {}, "
                               "readings on {}{}",
                               printable(topic), listed(names(contents.images)), listed(names(contents.imu)), aiding)};
    }
  }
  if (std::ssize(out.cameras) > kMostCameras)
    return Error{ErrorCode::invalid_argument, fmt::format("--topics names more than {} cameras", kMostCameras)};
  return out;
}

}  // namespace

bool names_depth(const std::string& topic) {
  constexpr std::string_view kDepth = "depth";
  if (topic.ends_with("/compressedDepth")) return true;
  const auto is_letter = [&](std::size_t i) {
    return i < topic.size() && std::isalpha(static_cast<unsigned char>(topic[i])) != 0;
  };
  const auto same = [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; };
  for (std::size_t i = 0; i + kDepth.size() <= topic.size(); ++i)
    if (std::equal(kDepth.begin(), kDepth.end(), topic.begin() + static_cast<std::ptrdiff_t>(i),
                   [&](char wanted, char is) { return same(is, wanted); }) &&
        (i == 0 || !is_letter(i - 1)) && !is_letter(i + kDepth.size()))
      return true;
  return false;
}

bool names_rectified(const std::string& topic) {
  const auto is_letter = [&](std::size_t i) {
    return i < topic.size() && std::isalpha(static_cast<unsigned char>(topic[i])) != 0;
  };
  for (std::size_t at = topic.find("rect"); at != std::string::npos; at = topic.find("rect", at + 1))
    if ((at == 0 || !is_letter(at - 1)) && (!is_letter(at + 4) || topic.compare(at + 4, 5, "ified") == 0)) return true;
  return false;
}

Result<ChosenTopics> choose_topics(const BagContents& contents, const std::vector<std::string>& named,
                                   const WantedTopics& wanted) {
  Result<ChosenTopics> out = sorted_by_kind(contents, named);
  if (!out) return out;
  if (out->cameras.empty()) {
    Result<std::vector<std::string>> found = own_cameras(contents);
    if (found->empty()) found = find_rig(contents);
    if (!found) return found.error();
    out->cameras = *std::move(found);
    out->cameras.resize(std::min(out->cameras.size(), static_cast<std::size_t>(wanted.most_cameras)));
  }
  if (!contents.rig.empty())
    for (const auto& [topic, readings] : contents.aiding)
      if (is_own_aiding_topic(topic) && std::ranges::find(out->aiding, topic) == out->aiding.end()) out->aiding.push_back(topic);
  if (wanted.one_camera) out->cameras.resize(1);
  const std::vector<std::string> depths = image_topics(contents, true);
  if (!wanted.depth || out->cameras.size() > 1) out->depth.clear();
  else if (out->depth.empty() && depths.size() == 1) out->depth = depths.front();
  else if (out->depth.empty() && depths.size() > 1)
    return ask(fmt::format("has {} topics of depth images", depths.size()), depths, "are registered to the camera");
  if (Result<void> imu = add_imu(contents, wanted.imu, *out); !imu) return imu.error();
  return out;
}

Result<ChosenTopics> choose_cameras(const BagContents& contents, const std::vector<std::string>& named) {
  Result<ChosenTopics> out = sorted_by_kind(contents, named);
  if (!out) return out;
  out->depth.clear();
  if (out->cameras.empty()) {
    Result<std::vector<std::string>> found = find_all_cameras(contents);
    if (!found) return found.error();
    out->cameras = *std::move(found);
  }
  if (Result<void> imu = add_imu(contents, false, *out); !imu) return imu.error();
  return out;
}

}  // namespace fbvins
