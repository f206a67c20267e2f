// SPDX-License-Identifier: Apache-2.0
// Private: a recording of one to eight cameras and an IMU as it lies there, without any calibration: what is needed to make one.
// One thread at a time; what take() returns is decoded on any.
//
//   Result<CameraRecording> recording = open_euroc_cameras("board");
//   for (std::size_t i = 0; i < recording->images.size(); ++i) use(recording->take(i)());
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

struct ListedImage {
  Time t;
  int camera = 0;
  std::string name;  ///< for people, and different from all others of the recording
};

struct CameraRecording {
  using Decode = std::function<Result<Image>()>;

  std::vector<std::string> cameras;  ///< their folders or topics
  std::string imu_name;              ///< empty: none
  std::vector<ListedImage> images;   ///< in order of time, all cameras
  std::function<Decode(std::size_t)> take;
  std::vector<ImuSample> imu;
  std::optional<ImuNoise> imu_noise;  ///< where the recording tells it
  std::vector<std::string> warnings;
};

/// By time, then by camera.
void sort_by_time(std::vector<ListedImage>& images);

/// A folder or zip in EuRoC's layout: cam0 to cam7 without a gap, imu0 if there is one. Calibrations in it are not read, the
/// IMU's noise is.
Result<CameraRecording> open_euroc_cameras(const std::string& path);

}  // namespace fbvins
