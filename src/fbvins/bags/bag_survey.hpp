// SPDX-License-Identifier: Apache-2.0
// Private: what is in a bag, also where it cannot be run yet: without a calibration, or before it is known which topics to use.
// Any thread.
//
//   Result<BagSurvey> survey = survey_bag("flight.bag", {});
//   for (const TopicSurvey& topic : survey->topics) print(topic.name, topic.rate_hz);
#pragma once

#include <string>
#include <vector>

#include "fbvins/bags/bag_reader.hpp"
#include "fbvins/bags/recording.hpp"

namespace fbvins {

struct TopicSurvey {
  std::string name, type;  ///< as printable text
  int messages = 0;
  double rate_hz = 0;  ///< one over the median interval of recording; 0: one message
  std::string first;   ///< of images: "752 x 480 mono8", and why it cannot be read; of IMUs the frame
};

struct BagSurvey {
  std::string format;
  std::vector<TopicSurvey> topics;   ///< by name
  double duration_s = 0;             ///< from the first message to the last
  std::vector<std::string> cameras;  ///< topics that would be used; empty: `question` says why
  std::string imu, depth;            ///< likewise; no depth images: empty
  std::string question;              ///< "has two pairs of ...: say which with --topics"; empty: none
  std::string unreadable;            ///< why images of these cameras cannot be read, all being of one encoding; empty: they can
  std::string no_calibration;        ///< why the bag's own calibration is none; empty: it has one, or one is given
  std::vector<std::string> warnings;
};

/// An error where the file is no bag. Topics that the options name and the bag has not are in `question`.
Result<BagSurvey> survey_bag(const std::string& path, const RecordingOptions& options);
BagSurvey survey_bag(BagReader& bag, const RecordingOptions& options);

}  // namespace fbvins
