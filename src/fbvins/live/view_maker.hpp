// SPDX-License-Identifier: Apache-2.0
// Private: combines an image's features with the window's landmarks, for display. One thread, in this order of calls.
//
//   views.add(tracked_frame);
//   views.add(window_snapshot);
//   hub.publish(views.view_of(odometry, shutter_to_pose_ms));
#pragma once

#include "fbvins/camera/camera.hpp"
#include "fbvins/live/live_event.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

class ViewMaker {
 public:
  explicit ViewMaker(const StereoRig& rig) : rig_(rig) {}

  void add(const TrackedFrame& frame);
  void add(WindowSnapshot window) { window_ = std::move(window); }
  /// Without features unless `odometry` is of the frame that was added last.
  LiveView view_of(const Odometry& odometry, double shutter_to_pose_ms);

 private:
  StereoRig rig_;
  Time t_;
  std::vector<LiveView::Feature> features_, right_features_;
  WindowSnapshot window_;
};

}  // namespace fbvins
