// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/finding.hpp"

#include <fmt/format.h>

namespace fbvins {

std::string_view to_string(FindingKind kind) {
  switch (kind) {
    case FindingKind::gyro_units: return "gyro_units";
    case FindingKind::accel_units: return "accel_units";
    case FindingKind::gyro_axes: return "gyro_axes";
    case FindingKind::accel_axes: return "accel_axes";
    case FindingKind::gyro_scale: return "gyro_scale";
    case FindingKind::gyro_bias: return "gyro_bias";
    case FindingKind::accel_scale: return "accel_scale";
    case FindingKind::accel_bias: return "accel_bias";
    case FindingKind::gyro_by_force: return "gyro_by_force";
    case FindingKind::accel_alignment: return "accel_alignment";
    case FindingKind::imu_noise: return "imu_noise";
    case FindingKind::saturation: return "saturation";
    case FindingKind::vibration: return "vibration";
    case FindingKind::imu_stuck: return "imu_stuck";
    case FindingKind::imu_spikes: return "imu_spikes";
    case FindingKind::imu_stamps: return "imu_stamps";
    case FindingKind::imu_gaps: return "imu_gaps";
    case FindingKind::clocks_apart: return "clocks_apart";
    case FindingKind::clocks_drift: return "clocks_drift";
    case FindingKind::time_offset: return "time_offset";
    case FindingKind::accel_late: return "accel_late";
    case FindingKind::extrinsics_inverted: return "extrinsics_inverted";
    case FindingKind::imu_camera_rotation: return "imu_camera_rotation";
    case FindingKind::imu_camera_position: return "imu_camera_position";
    case FindingKind::imu_camera_disagree: return "imu_camera_disagree";
    case FindingKind::swapped_images: return "swapped_images";
    case FindingKind::same_image_twice: return "same_image_twice";
    case FindingKind::stereo_sync: return "stereo_sync";
    case FindingKind::right_camera_turned: return "right_camera_turned";
    case FindingKind::baseline_direction: return "baseline_direction";
    case FindingKind::baseline_length: return "baseline_length";
    case FindingKind::epipolar_error: return "epipolar_error";
    case FindingKind::calibration_size: return "calibration_size";
    case FindingKind::focal_length: return "focal_length";
    case FindingKind::principal_point: return "principal_point";
    case FindingKind::distortion: return "distortion";
    case FindingKind::images_turned: return "images_turned";
    case FindingKind::images_mirrored: return "images_mirrored";
    case FindingKind::image_stamps: return "image_stamps";
    case FindingKind::image_gaps: return "image_gaps";
    case FindingKind::frozen_images: return "frozen_images";
    case FindingKind::blur: return "blur";
    case FindingKind::rolling_shutter: return "rolling_shutter";
    case FindingKind::projector_dots: return "projector_dots";
    case FindingKind::fixed_in_view: return "fixed_in_view";
  }
  return "unknown";
}

std::string to_text(const Finding& finding) {
  std::string text = fmt::format("{}: {}; {}; {}", to_string(finding.kind), finding.measured, finding.expected, finding.advice);
  for (std::size_t at = 0; at < finding.corrected.size();) {
    const std::size_t end = finding.corrected.find('\n', at);
    text += "\n    " + finding.corrected.substr(at, end - at);
    if (end == std::string::npos) break;
    at = end + 1;
  }
  return text;
}

}  // namespace fbvins
