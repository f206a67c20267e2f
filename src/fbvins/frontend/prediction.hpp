// SPDX-License-Identifier: Apache-2.0
// Predicted motion of the left camera between two images, from the gyro and, when the estimator has a state, from
// that state propagated by the IMU. For guided matching and outlier checks; never a measurement of the estimator.
//
//   MotionPredictor predictor(rig.T_BC0());
//   predictor.add(packet.imu, prior);
//   CameraMotion motion = predictor.between(t_then, t_now);
//   Vec3 ray_now = motion.R_ba * ray_then;      // + motion.p_ba / depth, if motion.has_translation
#pragma once

#include <deque>

#include "fbvins/camera/camera.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// Motion of the left camera from image a to image b: p_b = R_ba * p_a + p_ba.
struct CameraMotion {
  Mat3 R_ba = Mat3::Identity();
  Vec3 p_ba = Vec3::Zero();      ///< metres, in the camera at b
  bool has_rotation = false;     ///< IMU readings covered the time between
  bool has_translation = false;  ///< a valid prior could be propagated to both images
};

/// A feature of image a, transformed by the motion to b.
struct CarriedPoint {
  Vec3 p;  ///< in the camera at b, scaled so that its depth at a was 1: p.z() is depth at b / depth at a
  /// Its projections. A track's pixel is moved by their difference, so that no motion leaves it exactly where it is.
  Vec2 a_px = Vec2::Zero(), b_px = Vec2::Zero();
};

/// Nothing where one of the two has no projection. `inverse_depth`, 1/m, matters if the motion has a translation; the motion
/// must have a rotation.
std::optional<CarriedPoint> carry_point(const Camera& camera, const CameraMotion& motion, const Vec2& normalised,
                                        double inverse_depth);

class MotionPredictor {
 public:
  explicit MotionPredictor(const Pose<B, C0>& T_BC0) : T_BC0_(T_BC0) {}

  /// Keeps the readings of the last 1.5 s, and the newest valid prior: where an image has none, the one before is
  /// propagated, for up to half a second.
  void add(const ImuSegment& imu, const StatePrior& prior);
  /// G is a new frame, or what was known in it no longer fits: the prior is void.
  void forget_state() { prior_ = {}; }
  /// Drops readings older than this.
  void forget_before(Time t);

  CameraMotion between(Time a, Time b) const;
  /// What T_C1C0 is between images that the two cameras took at different times. Without readings it is unchanged, without a
  /// prior the motion is a turn alone.
  Pose<C1, C0> at_exposures(const Pose<C1, C0>& T_C1C0, Time left, Time right) const;
  /// Pose of the left camera in G; nothing without a prior that can be propagated to t.
  std::optional<Pose<G, C0>> camera_at(Time t) const;

 private:
  struct State {
    Time t;
    Pose<G, B> T_GB;
    Vec3 v_GB = Vec3::Zero();
  };
  bool covers(Time a, Time b) const;
  bool state_reaches(Time t) const;
  State state_at(Time t) const;
  State carry(const State& from, Time to) const;

  Pose<B, C0> T_BC0_;
  StatePrior prior_;               // the newest valid one, if any
  std::deque<ImuSample> samples_;  // in order of time; the stamps of images are among them
};

}  // namespace fbvins
