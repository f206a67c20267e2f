// SPDX-License-Identifier: Apache-2.0
// Says of each observation when and from where it was seen, if that was not at the frame's stamp: rows of a rolling shutter, and
// cameras without a common trigger (docs/derivations/rolling_shutter.md, S1-S4). Row v of camera i is taken at
// t + offsets.of(i) + (v - height / 2) * line_delay_s of that camera.
//
//   exposures.refer_to_stamp(ExposureMotion(frame.imu, bias, gravity_B), calibration, frame);
//
// Values; const members may be called from any thread.
#pragma once

#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/imu/exposure_motion.hpp"
#include "fbvins/types/calibration.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

class Exposures {
 public:
  explicit Exposures(const StereoRig& rig);

  /// Whether everything in the frame was seen at its stamp.
  bool at_stamp(const TrackedFrame& frame) const {
    return !rolling_ && line_delay_correction_s_ == 0 && frame.offsets.all_zero();
  }
  /// Of all cameras, in addition to the rig's.
  void correct_line_delay(double by_s) { line_delay_correction_s_ = by_s; }
  /// Turns the normalised positions into the axes that the cameras have at the stamp, and fills `rows`, `after_s` and `lever_B`;
  /// pixels stay as seen.
  void refer_to_stamp(const ExposureMotion& motion, const Calibration& calibration, TrackedFrame& frame) const;

 private:
  struct Shutter {
    double middle_row_px, line_delay_s;
  };

  bool rolling_;
  double line_delay_correction_s_ = 0;
  bool depth_;  // a depth has its pixel's time
  std::vector<Shutter> shutters_;
};

}  // namespace fbvins
