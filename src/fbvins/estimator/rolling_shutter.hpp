// SPDX-License-Identifier: Apache-2.0
// Brings observations of a rolling shutter to the image's stamp (docs/derivations/rolling_shutter.md, S1-S4), by the motion
// that the IMU measures. Row v is taken at t_image + (v - height / 2) * line_delay_s.
//
//   ShutterMotion motion = turning_at_end(frame.imu, bias.gyro_radps);
//   shutter.bring_to_stamp(motion, calibration, nullptr, frame.features);
//
// A value; const members may be called from any thread.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/types/calibration.hpp"
#include "fbvins/types/imu.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// Motion of the body about the stamp of an image, in B.
struct ShutterMotion {
  Vec3 w_B = Vec3::Zero();      ///< rad/s, at the stamp
  Vec3 alpha_B = Vec3::Zero();  ///< rad/s^2
  Vec3 v_B = Vec3::Zero();      ///< m/s; zero while unknown
};

/// The turning at the end of readings, without the bias: the rate there and its slope over the last 25 ms. Zero without readings.
ShutterMotion turning_at_end(const ImuSegment& readings, const Vec3& gyro_bias_radps);

/// 1/m, along z of the camera; nothing where the point is not known.
using InverseDepth = std::function<std::optional<double>(const TrackedFeature&, bool right)>;

class RollingShutter {
 public:
  explicit RollingShutter(const StereoRig& rig);

  bool global() const { return line_delay_s_ == 0; }
  /// Changes the normalised positions and fills `rows`; pixels stay as seen. The depth of a point that `known` (may be null) does
  /// not have is that of its stereo match; without one the point counts as far away.
  void bring_to_stamp(const ShutterMotion& motion, const Calibration& calibration, const InverseDepth* known,
                      std::vector<TrackedFeature>& features) const;

 private:
  double line_delay_s_;
  std::vector<int> heights_px_;  ///< of the cameras' images
};

}  // namespace fbvins
