// SPDX-License-Identifier: Apache-2.0
// How the left camera has moved between two images, from the gyro and, when the estimator has a state, from
// that state carried on by the IMU. Guides matching only: nothing here reaches the estimate.
//
//   MotionPredictor predictor(rig.T_BC0);
//   predictor.add(packet.imu);
//   CameraMotion motion = predictor.between(t_then, t_now, prior);
//   Vec3 ray_now = motion.R_ba * ray_then;      // + motion.p_ba / depth, if motion.has_translation
#pragma once

#include <deque>

#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// Motion of the left camera from image a to image b: p_b = R_ba * p_a + p_ba.
struct CameraMotion {
  Mat3 R_ba = Mat3::Identity();
  Vec3 p_ba = Vec3::Zero();      ///< metres, in the camera at b
  bool has_rotation = false;     ///< IMU readings covered the time between
  bool has_translation = false;  ///< a valid prior could be carried to both images
};

class MotionPredictor {
 public:
  explicit MotionPredictor(const Pose<B, C0>& T_BC0) : T_BC0_(T_BC0) {}

  /// Keeps the readings of the last second or so.
  void add(const ImuSegment& imu);
  /// Readings older than this are of no use any more.
  void forget_before(Time t);

  CameraMotion between(Time a, Time b, const StatePrior& prior) const;
  /// The left camera in W; nothing without a valid prior that can be carried to t.
  std::optional<Pose<W, C0>> camera_at(Time t, const StatePrior& prior) const;

 private:
  struct State {
    Time t;
    Pose<W, B> T_WB;
    Vec3 v_WB = Vec3::Zero();
  };
  bool covers(Time a, Time b) const;
  State carry(const State& from, Time to, const ImuBias& bias, const Vec3& gravity_W) const;

  Pose<B, C0> T_BC0_;
  std::deque<ImuSample> samples_;  // in order of time; the stamps of images are among them
};

}  // namespace fbvins
