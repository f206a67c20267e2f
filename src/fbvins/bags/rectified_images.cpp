// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/rectified_images.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <vector>

#include "fbvins/frontend/stereo_matches.hpp"
#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

constexpr int kJudged = 8;  // pairs of images, spread over the recording
/// Of 48 times eight pairs of EuRoC's cameras the right lenses had 616 to 933 matches, the wrong ones at most 46 (MH_01_easy_17s,
/// real; V1_02, V2_02 and MH_03, rendered). With lenses that differ less the names decide.
constexpr int kFewestMatches = 40;
constexpr double kTimesMore = 3;

std::string listed(const std::vector<std::string>& topics) {
  std::vector<std::string> out;
  for (const std::string& topic : topics) out.push_back(printable(topic));
  return fmt::format("{}", fmt::join(out, ", "));
}

/// Whether features of the recording's images are found along the epipolar lines of `other`, and not along those of its own rig.
bool belong_to(const StereoRig& other, const DatasetContents& recording) {
  std::vector<StereoFrame> frames;
  for (std::size_t i = 0; i < kJudged; ++i)
    frames.push_back(recording.loader->load(recording.frames[(2 * i + 1) * recording.frames.size() / (2 * kJudged)]).frame);
  const std::vector<int> matched = count_stereo_matches(std::array{recording.rig, other}, frames).matched;
  return matched[1] >= kFewestMatches && matched[1] >= kTimesMore * matched[0];
}

}  // namespace

void judge_rectified(BagContents& contents, const ChosenTopics& topics, const std::string& given, DatasetContents& recording) {
  const std::vector<std::string> differ = rectifiable_topics(contents, topics), named = rectified_topics(contents, topics);
  if (differ.empty()) return;
  std::vector<std::string>& said = recording.info.warnings;
  if (topics.cameras.size() > 1) {
    contents.rectified = named.empty();
    const Result<StereoRig> other = rig_of(contents, topics, given);
    contents.rectified.reset();
    if (other && belong_to(*other, recording)) {
      recording.rig = with_cameras(recording.rig, other->cameras);
      said.push_back(fmt::format(
          "the images on {} are {} by what they show, not {} as their names say: {} of camera_info are used", listed(differ),
          named.empty() ? "rectified" : "raw", named.empty() ? "raw" : "rectified", named.empty() ? "R and P" : "K and D"));
      return;
    }
  }
  if (!named.empty())
    said.push_back(fmt::format(
        "the images on {} are taken as rectified by their name: R and P of camera_info are used, not K and D", listed(named)));
}

}  // namespace fbvins
