// SPDX-License-Identifier: Apache-2.0
// Private to bags: all that a bag holds except the images, read in one pass, and the choice of a recording's topics.
// One thread.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/bags/bag_messages.hpp"
#include "fbvins/bags/bag_reader.hpp"
#include "fbvins/io/euroc_frames.hpp"
#include "fbvins/io/row_counts.hpp"

namespace fbvins {

struct ImuTopic {
  std::vector<ImuSample> samples;  ///< in recorded order
  std::string frame;
  int malformed = 0;
};

struct ImageTopic {
  std::vector<ImageRow> rows;  ///< in recorded order; `file` is the message's place
  bool compressed = false;
  Encoding encoding = Encoding::ros1;
  int malformed = 0;
};

struct BagContents {
  std::map<std::string, ImuTopic> imu;  ///< by topic
  std::map<std::string, ImageTopic> images;
  std::map<std::string, BagCamera> cameras;   ///< first camera_info of each topic
  std::string camera_problem;                 ///< why the first unusable one cannot be used
  std::vector<BagTransform> transforms;       ///< the static ones
  std::vector<TrajectoryPoint> ground_truth;  ///< of the topic /ground_truth
  std::string rig;                            ///< of a bag that `fbvins convert` wrote: all of its calibration (rig_text.hpp)
};

/// `on_message` is called with every message before it is read.
BagContents read_contents(BagReader& bag, const std::function<void(const BagMessage&, const BagTopic&)>& on_message = {});

/// A message's place as a FrameEntry names it, and back.
std::string place_name(const MessagePlace& place);
MessagePlace place_of(const std::string& name);

struct ChosenTopics {
  std::string left, right, imu;
  std::string accel;  ///< of a separate accelerometer: `imu` is the gyroscope's then; found by its name, never given
};
/// Those in `named`, else the only ones of their kind or those with left and right, gyroscope and accelerometer in their names.
/// The error lists the topics there are.
Result<ChosenTopics> choose_topics(const BagContents& contents, const ChosenTopics& named, bool imu_needed);

/// All of the calibration, noise figures included, where the bag has it for these topics.
std::optional<Result<StereoRig>> own_rig(const BagContents& contents, const ChosenTopics& topics);
/// From camera_info and transforms. The error says what is missing.
Result<StereoRig> rig_of(const BagContents& contents, const ChosenTopics& topics);

}  // namespace fbvins
