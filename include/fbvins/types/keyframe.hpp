// SPDX-License-Identifier: Apache-2.0
// What the estimator hands to loop closure: a frame worth remembering.
#pragma once

#include <cstdint>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/gauge.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// A landmark of the sliding window as this keyframe sees it.
struct KeyframeLandmark {
  TrackId track;
  Vec2 pixel = Vec2::Zero();  ///< in the raw left image, px
  Vec3 p_B = Vec3::Zero();    ///< in the body at the keyframe, m
};

/// What the IMU says of the way from the keyframe before, and how it is to be read.
struct KeyframeImu {
  std::vector<ImuSegment> segments;  ///< one joins the next; empty for the first keyframe and where readings are missing
  ImuBias bias;                      ///< at the keyframe, as the estimator knew it
  ImuNoise noise;                    ///< as the estimator weighs readings
  double gravity_mps2 = 9.81;
};

/// A keyframe as it leaves the newest frames of the window: its pose has been refined by a few later
/// images and is final enough for the map, which corrects it further.
struct Keyframe {
  FrameId id;
  Time t;
  Pose<W, B> T_WB;
  Vec3 v_WB = Vec3::Zero();
  GaugeState gauge;                     ///< as it was seen, not turned level
  Pose<W, G> T_WG;                      ///< of the newest published pose when this was handed on; set by the pipeline
  Mat6 pose_covariance = Mat6::Zero();  ///< of (dp in W, dtheta in B), from the start of W
  std::uint32_t reset_counter = 0;      ///< a new value: W is a new frame, nothing joins it to the old
  StereoFrame images;
  std::vector<KeyframeLandmark> landmarks;
  KeyframeImu imu;  ///< but for the bias set by the pipeline
};

}  // namespace fbvins
