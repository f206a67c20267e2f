// SPDX-License-Identifier: Apache-2.0
// What the estimator hands to loop closure.
#pragma once

#include <cstdint>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/anchor.hpp"
#include "fbvins/types/gauge.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// A landmark of the sliding window as this keyframe sees it.
struct KeyframeLandmark {
  TrackId track;
  Vec2 pixel = Vec2::Zero();  ///< in the raw image of `camera`, px
  Vec3 p_B = Vec3::Zero();    ///< in the body at the keyframe, m
  int camera = 0;             ///< of the rig; of a pair the left one where both see it
};

/// The IMU's readings since the keyframe before, with the bias, noise and gravity to preintegrate them with.
struct KeyframeImu {
  std::vector<ImuSegment> segments;  ///< consecutive; empty for the first keyframe and where readings are missing
  ImuBias bias;                      ///< at the keyframe, as estimated
  ImuNoise noise;                    ///< with which the estimator weights the readings
  double gravity_mps2 = 9.81;
};

/// A keyframe as it leaves the newest frames of the window: its pose has been refined by a few later
/// images; the map corrects it further.
struct Keyframe {
  FrameId id;
  Time t;
  Pose<W, B> T_WB;
  Vec3 v_WB = Vec3::Zero();
  GaugeState gauge;  ///< in the estimator's own frame, not levelled
  /// Of gauge.T_GB, as (dp in G, dtheta in B), since G began; zero: unknown.
  Mat6 pose_covariance = Mat6::Zero();
  /// Of all distances together, as Odometry::scale_sigma; 0: the cameras measure them.
  double scale_sigma = 0;
  Pose<W, G> T_WG;                  ///< of the newest published pose when this was handed on; set by the pipeline
  std::uint32_t reset_counter = 0;  ///< a new value: W is a new frame, with no known relation to the old
  StereoFrame images;
  std::vector<KeyframeLandmark> landmarks;
  KeyframeImu imu;                   ///< set by the pipeline, except for the bias
  std::vector<Anchor> anchors = {};  ///< that came since the keyframe before, none later than this one; set by the pipeline
};

}  // namespace fbvins
