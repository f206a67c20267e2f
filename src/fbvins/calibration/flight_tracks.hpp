// SPDX-License-Identifier: Apache-2.0
// What a flight leaves for its calibration: its keyframes as the odometry estimated them, the readings between them, and where
// each camera saw the features that the frontend followed, in pixels of the raw images. One thread.
//
//   FlightCollector collector(rig);
//   system.on_tracked_frame([&](const TrackedFrame& f) { collector.add(f); });
//   system.on_keyframe([&](const Keyframe& k) { collector.add(k); });
//   FlightTracks tracks = collector.take();
#pragma once

#include <map>
#include <vector>

#include "fbvins/imu/nav_state.hpp"
#include "fbvins/types/keyframe.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// A feature in one image.
struct FlightView {
  TrackId track;
  int camera = 0;
  Vec2 pixel = Vec2::Zero();  ///< raw image
};

struct FlightKeyframe {
  Time t;
  NavState<W> state;            ///< level, as estimated in flight
  std::vector<ImuSegment> imu;  ///< since the keyframe before; empty: it is not known what was between
  std::vector<FlightView> views;
  bool new_frame = false;  ///< W is another one than the keyframe's before
};

struct FlightTracks {
  std::vector<FlightKeyframe> keyframes;
  ImuNoise noise;
  double gravity_mps2 = kGravity_mps2;
  bool untriggered = false;  ///< cameras took their images at different times
};

class FlightCollector {
 public:
  void add(const TrackedFrame& frame);
  /// A keyframe comes after its tracked frame.
  void add(const Keyframe& keyframe);
  FlightTracks take();

 private:
  FlightTracks tracks_;
  std::vector<std::uint32_t> resets_;                ///< of each keyframe
  std::map<std::uint32_t, Quat> q_LG_;               ///< as known last, by reset counter
  std::map<FrameId, std::vector<FlightView>> seen_;  ///< in frames that may become keyframes
};

}  // namespace fbvins
