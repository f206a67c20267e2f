// SPDX-License-Identifier: Apache-2.0
// Says of each observation when and from where it was seen, if that was not at the frame's stamp: rows of a rolling shutter, and
// cameras without a common trigger (docs/derivations/rolling_shutter.md, S1-S4). Row v of camera i is taken at
// t + offsets.of(i) + (v - height / 2) * line_delay_s.
//
//   exposures.refer_to_stamp(ExposureMotion(frame.imu, bias, gravity_B), calibration, frame);
//
// Values; const members may be called from any thread.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/types/calibration.hpp"
#include "fbvins/types/imu.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// How the body turned and accelerated about the stamp of a frame, by the readings that end there. In B at the stamp.
class ExposureMotion {
 public:
  /// Without readings the body neither turns nor accelerates; without gravity it is not known to accelerate.
  ExposureMotion(const ImuSegment& readings, const ImuBias& bias, const std::optional<Vec3>& gravity_B_mps2 = std::nullopt);

  /// The body's axes `after_s` after the stamp. Before it by the readings, after it by the rate and its slope at the end.
  Quat turn(double after_s) const;
  /// How far the body had moved by then if it was at rest at the stamp, m.
  Vec3 moved(double after_s) const { return 0.5 * after_s * after_s * accel_mps2_; }

 private:
  /// At a reading: turn from the stamp, and the rate.
  struct Knot {
    double after_s;
    Quat q;
    Vec3 rate_radps;
  };
  std::vector<Knot> knots_;  // from the newest back
  Vec3 slope_radps2_ = Vec3::Zero();
  Vec3 accel_mps2_ = Vec3::Zero();
};

class Exposures {
 public:
  explicit Exposures(const StereoRig& rig);

  /// Whether everything in the frame was seen at its stamp.
  bool at_stamp(const TrackedFrame& frame) const { return line_delay_s_ == 0 && frame.offsets.all_zero(); }
  /// Turns the normalised positions into the axes that the cameras have at the stamp, and fills `rows`, `after_s` and `lever_B`;
  /// pixels stay as seen.
  void refer_to_stamp(const ExposureMotion& motion, const Calibration& calibration, TrackedFrame& frame) const;

 private:
  double line_delay_s_;
  bool depth_;  // a depth has its pixel's time
  std::vector<int> heights_px_;
};

}  // namespace fbvins
