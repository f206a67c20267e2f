// SPDX-License-Identifier: Apache-2.0
// StereoFrame -> TrackedFrame: follows features over time and across the stereo pair.
// A plain synchronous stage: no thread, no clock; one instance is used by one thread at a time.
//
//   auto frontend = make_frontend(rig, options);   // a Result: *frontend is the unique_ptr
//   TrackedFrame tracked = (*frontend)->process(packet, prior);
#pragma once

#include <memory>

#include "fbvins/camera/camera.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

class Frontend {
 public:
  virtual ~Frontend() = default;

  /// Features of the newest image. `prior` is the newest state fed back by the estimator
  /// (usually two frames old; not valid before initialisation); the packet's IMU readings
  /// propagate it. A missing image gives a frame without features of that camera.
  virtual TrackedFrame process(const SensorPacket& packet, const StatePrior& prior) = 0;

  /// Positions of landmarks that have left the estimator's window. Updates come in order and without gaps, before the image
  /// that follows them; one that comes twice counts once. For frontends that re-observe landmarks under their old track; others
  /// ignore the positions.
  virtual void locate(const LandmarkUpdate& update) { (void)update; }

  /// How many features it may follow from the next image on, never more than it was made for: its share of a rig's, of which
  /// other cameras use less at times. One that ignores it costs more time.
  virtual void follow_at_most(int features) { (void)features; }
};

}  // namespace fbvins
