// SPDX-License-Identifier: Apache-2.0
// The body's motion about the stamp of a frame, for what was seen somewhat before or after it
// (docs/derivations/rolling_shutter.md, S2). Values; const members may be called from any thread.
//
//   const ExposureMotion motion(frame.imu, bias, gravity_B);
//   const Pose<B, B> then = motion.body(-0.02, v_B);
#pragma once

#include <optional>
#include <vector>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/imu.hpp"

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
  /// Its pose by then, with this velocity at the stamp, m/s.
  Pose<B, B> body(double after_s, const Vec3& v_B_mps) const { return {turn(after_s), after_s * v_B_mps + moved(after_s)}; }

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

}  // namespace fbvins
