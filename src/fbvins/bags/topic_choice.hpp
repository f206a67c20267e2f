// SPDX-License-Identifier: Apache-2.0
// Private to bags: which topics of a bag are a recording's. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "fbvins/bags/bag_contents.hpp"

namespace fbvins {

/// Those in `named`, else the only ones of their kind or those with left and right, gyroscope and accelerometer in their names.
/// The error lists the topics there are.
Result<ChosenTopics> choose_topics(const BagContents& contents, const ChosenTopics& named, bool imu_needed);

struct CameraTopics {
  std::vector<std::string> cameras;
  std::string imu;    ///< empty: none
  std::string accel;  ///< as ChosenTopics has it
};
/// The same for any number of cameras: `named` are those of the cameras, in their order, and of the IMU.
Result<CameraTopics> choose_cameras(const BagContents& contents, const std::vector<std::string>& named);

}  // namespace fbvins
