// SPDX-License-Identifier: Apache-2.0
// Private to calibration: start values of the camera-IMU calibration from nothing (docs/derivations/calibration.md, A1-A5). Pure
// functions.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/calibration/imu_camera.hpp"

namespace fbvins {

/// Where a camera was over the board, from one image alone.
struct SeenPose {
  int camera = 0;
  double t_s = 0;  ///< image's stamp since the reference
  Pose<T, Cn> T_TC;
  double sigma_px = 0;  ///< of one coordinate of most corners
};

/// The gyroscope's readings as a function of time: their integral.
class GyroIntegral {
 public:
  GyroIntegral(const std::vector<ImuSample>& readings, Time reference);
  /// Mean rate between two times; nullopt outside of the readings and where some are missing.
  std::optional<Vec3> mean_rate(double from_s, double to_s) const;
  double first_s() const { return first_s_; }
  double last_s() const { return first_s_ + step_s_ * static_cast<double>(sum_.size() - 1); }

 private:
  double first_s_ = 0, step_s_ = 1e-3;
  std::vector<Vec3> sum_;          ///< on a grid
  std::vector<double> missing_s_;  ///< time without readings until then
};

/// The turns of one camera and those of the IMU, brought together.
struct TurnMatch {
  double time_offset_s = 0;  ///< t_imu = t_image + offset
  Quat R_BC = Quat::Identity();
  Vec3 gyro_bias_radps = Vec3::Zero();
  double agreement = 0;              ///< 1: the same turns; as a correlation
  double mirrored_agreement = 0;     ///< if the IMU's axes were left-handed
  double gain = 1;                   ///< turns of the gyroscope to those of the camera
  Vec3 spread_radps = Vec3::Zero();  ///< of the camera's rates along their principal axes, largest first
  int pairs = 0;
};

/// At a known offset; nullopt with fewer than ten pairs of images.
std::optional<TurnMatch> match_turns_at(const std::vector<SeenPose>& poses, const GyroIntegral& gyro, double time_offset_s);
/// The offset found as well. An error, one sentence, where nothing stands out.
Result<TurnMatch> match_turns(const std::vector<SeenPose>& poses, const GyroIntegral& gyro, double max_offset_s);

}  // namespace fbvins
