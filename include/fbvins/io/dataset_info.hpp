// SPDX-License-Identifier: Apache-2.0
// What is in a recording, and what was left out of it. Values.
#pragma once

#include <string>
#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/io/row_counts.hpp"
#include "fbvins/types/by_camera.hpp"

namespace fbvins {

struct ImageSize {
  int width = 0, height = 0;  ///< px
  bool operator==(const ImageSize&) const = default;
};

/// A camera whose lens was scaled to its images (DatasetOptions::scale_lenses).
struct ScaledLens {
  int camera = 0;
  ImageSize calibrated, images;
};

/// What one camera's image files turned out to be.
struct ImageCounts {
  int missing = 0;     ///< listed, but there is no such file (known when opened)
  int corrupt = 0;     ///< cannot be decoded (known once delivered)
  int wrong_size = 0;  ///< not the size of the calibration (known once delivered)

  int bad() const { return missing + corrupt + wrong_size; }
  ImageCounts& operator+=(const ImageCounts& other) {
    missing += other.missing, corrupt += other.corrupt, wrong_size += other.wrong_size;
    return *this;
  }
};

struct CameraInfo {
  RowCounts rows;      ///< of the CSV that lists the images
  int listed = 0;      ///< good rows
  int unpaired = 0;    ///< images without a partner in the other camera
  ImageCounts images;  ///< among the frames that skip_frames and max_frames leave

  CameraInfo& operator+=(const CameraInfo& other) {
    rows += other.rows, listed += other.listed, unpaired += other.unpaired, images += other.images;
    return *this;
  }
};

/// Readings of the sensors of one kind that aid images and IMU.
struct AidingCount {
  std::string name;  ///< "rangefinder", "velocity", "barometer"
  int readings = 0;
  double rate_hz = 0;  ///< as those of images and IMU
};

struct DatasetInfo {
  std::string name;    ///< last part of the path
  std::string format;  ///< "EuRoC folder", "EuRoC zip" or "MCAP flight record"
  std::vector<CameraInfo> cameras;
  CameraInfo depth;  ///< of the depth sensor
  RowCounts imu_rows, ground_truth_rows;
  int frames = 0;  ///< frames that next() will deliver, less those found without any image
  int imu_samples = 0;
  std::vector<AidingCount> aiding = {};  ///< of those that there are
  int ground_truth_poses = 0;
  Time first_image, last_image, first_imu, last_imu;
  double image_rate_hz = 0, imu_rate_hz = 0;  ///< measured: one over the median interval
  Duration longest_image_gap, longest_imu_gap;
  Time longest_image_gap_start, longest_imu_gap_start;
  int frames_without_image = 0;   ///< no camera delivered: the frame is left out (counted once met)
  std::vector<Time> clock_steps;  ///< where the estimate begins anew, as the clock stepped back there; continued stamps
  std::vector<std::string> warnings;
  std::vector<ScaledLens> scaled;  ///< by camera

  CameraInfo& camera(int i) { return of_camera(cameras, i); }
  const CameraInfo& camera(int i) const { return of_camera(cameras, i); }
  /// Of the cameras from number 2 on together.
  CameraInfo further() const {
    CameraInfo sum;
    for (std::size_t i = 2; i < cameras.size(); ++i) sum += cameras[i];
    return sum;
  }
};

}  // namespace fbvins
