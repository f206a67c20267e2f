// SPDX-License-Identifier: Apache-2.0
// Private to bags: all that a bag holds except the images, read in one pass. One thread.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "fbvins/bags/bag_messages.hpp"
#include "fbvins/bags/bag_reader.hpp"
#include "fbvins/io/euroc_frames.hpp"
#include "fbvins/io/row_counts.hpp"

namespace fbvins {

struct ImuTopic {
  std::vector<ImuSample> samples;   ///< in recorded order
  std::vector<Time> recorded = {};  ///< when each was
  std::string frame;
  int malformed = 0;
};

struct ImageTopic {
  std::vector<ImageRow> rows;  ///< in recorded order; `file` is the message's place
  std::vector<Time> recorded = {};
  std::string frame;
  bool compressed = false;
  Encoding encoding = Encoding::ros1;
  int malformed = 0;
};

struct AidingTopic {
  std::vector<AidingSample> readings;  ///< in recorded order, as if the sensor's axes were the body's
  std::vector<Time> recorded = {};
  std::string frame;
  int malformed = 0;
};

struct BagContents {
  std::map<std::string, ImuTopic> imu;  ///< by topic
  std::map<std::string, ImageTopic> images;
  std::map<std::string, AidingTopic> aiding;
  std::map<std::string, BagCamera> cameras;   ///< first camera_info of each topic
  std::string camera_problem;                 ///< why the first unusable one cannot be used
  std::vector<BagTransform> transforms;       ///< the static ones
  std::vector<TrajectoryPoint> ground_truth;  ///< of the topic /ground_truth
  std::set<std::string> strangers;            ///< topics that are no messages of ROS (BagReader::strangers)
  std::optional<bool> rectified;              ///< whether its images are; unset: those whose topic's name says so
  std::string rig;                            ///< of a bag that `fbvins convert` wrote: all of its calibration (rig_text.hpp)
};

/// `on_message` is called with every message before it is read. `by_recording`: images and readings have the time at which they
/// were recorded instead of their own stamp.
BagContents read_contents(BagReader& bag, const std::function<void(const BagMessage&, const BagTopic&)>& on_message = {},
                          bool by_recording = false);

/// A message's place as a FrameEntry names it, and back.
std::string place_name(const MessagePlace& place);
MessagePlace place_of(const std::string& name);

/// In order of stamps, each once.
template <class Row>
std::vector<Row> in_order(std::vector<Row> rows, RowCounts& counts) {
  counts.rows += static_cast<int>(rows.size());
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.t < b.t; });
  const auto end = std::unique(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.t == b.t; });
  counts.duplicates += static_cast<int>(rows.end() - end);
  rows.erase(end, rows.end());
  return rows;
}

/// Readings in order; with a gyroscope and an accelerometer on topics of their own a reading for each of the
/// gyroscope's. `accel`: empty without.
std::vector<ImuSample> readings_on(BagContents& contents, const std::string& imu, const std::string& accel, RowCounts& counts);

struct ChosenTopics {
  std::vector<std::string> cameras;  ///< one at least, in the order of their numbers
  std::string imu;                   ///< empty: none
  std::string accel;  ///< of a separate accelerometer: `imu` is the gyroscope's then; found by its name, never given
  std::string depth;  ///< images of a depth sensor, for one camera; empty: none
  std::vector<std::string> aiding = {};  ///< of sensors that aid, named, or of a bag of ours
};

/// All of the calibration, noise figures included, where the bag has it for these topics; of cameras that are not among them,
/// too.
std::optional<Result<StereoRig>> own_rig(const BagContents& contents, const ChosenTopics& topics);
/// Takes camera_info files, a camera each in the order of the topics, instead of the bag's messages. Where the bag does not know
/// the place of the second camera, it is that of the files' R and P.
Result<void> take_camera_info(const std::string& paths, const ChosenTopics& topics, BagContents& contents);
/// From camera_info and transforms: K and D of raw images, R and P of rectified ones. The error says what is missing. `given`:
/// the camera_info files of take_camera_info(), if there are any.
Result<StereoRig> rig_of(const BagContents& contents, const ChosenTopics& topics, const std::string& given = "");
/// The topics whose rectified images camera_info tells from raw ones, and of these the ones whose images are taken as rectified.
std::vector<std::string> rectifiable_topics(const BagContents& contents, const ChosenTopics& topics);
std::vector<std::string> rectified_topics(const BagContents& contents, const ChosenTopics& topics);
/// Without those from number 2 on, which nobody has calibrated: colour cameras.
std::vector<std::string> calibrated_cameras(const BagContents& contents, const ChosenTopics& topics);
/// Why the depth images do not lie on those of the first camera, pixel by pixel, as far as the bag tells; empty: they do.
std::string not_registered(const BagContents& contents, const ChosenTopics& topics);
/// Takes coordinates in `from` to `to`, along the static transforms.
std::optional<Pose<B, B>> find_transform(const std::vector<BagTransform>& transforms, const std::string& to,
                                         const std::string& from);
/// The depth images' own lens and pose, by camera_info and transforms; nullopt where the bag has them not.
std::optional<MountedCamera> depth_camera_of(const BagContents& contents, const ChosenTopics& topics, const StereoRig& rig);

}  // namespace fbvins
