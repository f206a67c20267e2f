// SPDX-License-Identifier: Apache-2.0
// What is wrong with a setup: what was measured and how well, what it should be, what to do. Values.
//
//   for (const Finding& finding : findings) fmt::print("{}\n", to_text(finding));
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace fbvins {

enum class FindingKind {
  // the IMU alone
  gyro_units,
  accel_units,
  gyro_axes,
  accel_axes,
  gyro_scale,
  gyro_bias,
  gyro_by_force,
  accel_scale,
  accel_bias,
  accel_alignment,
  imu_noise,
  saturation,
  vibration,
  imu_stuck,
  imu_spikes,
  imu_stamps,
  imu_gaps,
  // camera and IMU
  clocks_apart,
  clocks_drift,
  time_offset,
  accel_late,
  extrinsics_inverted,
  imu_camera_rotation,
  imu_camera_position,
  imu_camera_disagree,
  // the pair of cameras
  swapped_images,
  same_image_twice,
  stereo_sync,
  right_camera_turned,
  baseline_direction,
  baseline_length,
  epipolar_error,
  // a lens
  calibration_size,
  focal_length,
  principal_point,
  distortion,
  // the images
  images_turned,
  images_mirrored,
  image_stamps,
  image_gaps,
  frozen_images,
  blur,
  rolling_shutter,
  projector_dots,
  fixed_in_view,
};

/// As in docs/doctor.md, which says more of each.
std::string_view to_string(FindingKind kind);

/// What of a calibration several findings may concern. Extrinsics and lenses are those of cam0 and of cam1.
enum class CalibrationField {
  mounting_of_left,
  mounting_of_right,
  size_of_left,
  size_of_right,
  lens_of_left,
  lens_of_right,
  distortion_of_left,
  distortion_of_right,
  mask_of_left,
  mask_of_right,
  time_offset,
  line_delay,
  imu_rate,
  imu_noise,
};

struct Finding {
  FindingKind kind = FindingKind::gyro_units;
  double size = 0;   ///< how wrong, in `unit`
  double sigma = 0;  ///< standard deviation of size; 0 where it was counted
  std::string unit;
  std::string measured;                       ///< a sentence without its full stop, with the uncertainty
  std::string expected;                       ///< the same: what it should be
  std::string advice;                         ///< the same: what to do
  std::string corrected;                      ///< lines of the calibration file, corrected; empty where no line is wrong
  std::vector<CalibrationField> fields = {};  ///< that must change; of a field with several findings the first has the line
};

/// "KIND: measured; expected; advice" and the corrected lines, indented.
std::string to_text(const Finding& finding);

}  // namespace fbvins
