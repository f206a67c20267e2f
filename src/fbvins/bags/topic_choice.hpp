// SPDX-License-Identifier: Apache-2.0
// Private to bags: which topics of a bag are a recording's. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "fbvins/bags/bag_contents.hpp"

namespace fbvins {

/// How the command line names all topics.
inline constexpr const char* kTopicsOption = "CAM0[,CAM1,...][,IMU][,DEPTH]";

/// What is asked of a recording.
struct WantedTopics {
  bool imu = true;                  ///< an error without
  bool one_camera = false;          ///< the first one, to which the depth images belong
  bool depth = false;               ///< of one camera, where there are any
  int most_cameras = kMostCameras;  ///< where they are found, not named: as many as the calibration has
};

/// Those in `named`, told apart by what is on them: cameras in their order, IMU, depth images, other sensors, which are used only
/// where they are named or the bag is one of ours. Where no camera is named: the only
/// image topic, the two with left and right in their names, or numbered ones (cam0, cam1, cam2 ...). Where no IMU is named: the
/// only one, or gyroscope and accelerometer by their names. The error lists the topics there are.
Result<ChosenTopics> choose_topics(const BagContents& contents, const std::vector<std::string>& named,
                                   const WantedTopics& wanted);

/// The same for cameras that need not be a rig yet: where none is named, all there are, by their names; no depth images.
Result<ChosenTopics> choose_cameras(const BagContents& contents, const std::vector<std::string>& named);

/// Whether a word of the topic's name is "depth": there, no camera's images are.
bool names_depth(const std::string& topic);
/// Whether the name says that the images are rectified, as image_proc's are: `rect` as a word (image_rect, image_rect_color).
bool names_rectified(const std::string& topic);

}  // namespace fbvins
