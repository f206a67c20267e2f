// SPDX-License-Identifier: Apache-2.0
// Whether gravity fits the attitude, by the estimated biases: a wrong tilt moves them, and so does a fault of the IMU that begins
// without a contradiction (docs/derivations/integrity.md). A tilt in doubt is confirmed by biases that are where they were for
// 1.5 s, and refuted by those that stay away.
//
//   tilt.add_turn(turn_G);                            // of the images against the readings
//   if (tilt.take(biases, contradicted)) restart();
//
// One owner, one thread.
#pragma once

#include <deque>
#include <optional>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/so3.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// As estimated at a time.
struct BiasEstimate {
  Time t;
  ImuBias bias;
  Mat3 gyro = Mat3::Zero(), accel = Mat3::Zero();  ///< covariances
};

class TiltCheck {
 public:
  /// After each solve. True where gravity refutes the attitude. `contradicted`: images and readings are in contradiction now, and
  /// confirm nothing.
  bool take(const BiasEstimate& now, bool contradicted);
  /// The images turned the attitude against the readings: a tilt of a degree, all in all, has to be confirmed.
  void add_turn(const Vec3& turn_G);
  /// Gravity has to confirm the tilt.
  void doubt();
  bool in_doubt() const { return in_doubt_; }
  /// The accelerometer's bias moves farther than is usual, but not so far that it has to be a fault.
  bool suspected() const { return suspected_; }
  /// Biases are being found anew, for a reason that is known: those of before confirm and refute nothing.
  void forget_biases() {
    biases_.clear();
    before_.reset(), refuted_.reset();
  }
  /// A window begins. Biases that were refuted before are remembered.
  void restart();

 private:
  void doubt(const BiasEstimate& before);

  bool in_doubt_ = false, suspected_ = false;
  Vec3 tilt_G_ = Vec3::Zero();  ///< of the turns, not confirmed by gravity
  std::optional<Time> begun_;
  std::deque<BiasEstimate> biases_;         ///< of the last two seconds
  std::optional<BiasEstimate> before_;      ///< the doubt
  std::optional<BiasEstimate> refuted_;     ///< those before a restart, which the ones after it refuted
  double confirmed_s_ = 0, refuted_s_ = 0;  ///< for how long the biases have said so
};

}  // namespace fbvins
