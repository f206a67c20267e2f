// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/view_maker.hpp"

#include <algorithm>
#include <unordered_map>
#include <utility>
#include <vector>

namespace fbvins {

void ViewMaker::add(const TrackedFrame& frame) {
  t_ = frame.t;
  features_.clear();
  right_features_.clear();
  features_.reserve(frame.features.size());
  right_features_.reserve(frame.features.size());
  for (const TrackedFeature& feature : frame.features)
    for (const Observation& o : feature.seen)
      (o.camera == feature.lead ? features_ : right_features_).push_back({feature.id, o.pixel, feature.age_frames, 0, o.camera});
}

LiveView ViewMaker::view_of(const Odometry& o, double shutter_to_pose_ms) {
  LiveView view{.t = o.t, .shutter_to_pose_ms = shutter_to_pose_ms};
  if (t_ == o.t) {
    view.features = std::exchange(features_, {});
    view.right_features = std::exchange(right_features_, {});
  }
  if (!o.health.has_pose() || window_.frames.empty()) return view;
  const Pose<W, B>& T_WB_window = window_.frames.back().T_WB;
  // From the window's gauge to the published frame, in which poses are corrected in small steps.
  const Pose<W, W> to_published = o.T_WB * T_WB_window.inverse();
  std::vector<Pose<C0, W>> T_CW;
  for (int i = 0; i < rig_.camera_count(); ++i) T_CW.push_back((T_WB_window * rig_.T_BC(i)).inverse());
  std::unordered_map<TrackId, Vec3> positions_W;
  view.landmarks.reserve(window_.landmarks.size());
  for (const WindowSnapshot::Landmark& landmark : window_.landmarks) {
    view.landmarks.push_back({landmark.track, to_published * landmark.p_W});
    positions_W.emplace(landmark.track, landmark.p_W);
  }
  for (const WindowSnapshot::Frame& frame : window_.frames)
    if (frame.keyframe) view.keyframes_W.push_back(to_published * frame.T_WB.p);
  for (std::vector<LiveView::Feature>* features : {&view.features, &view.right_features})
    for (LiveView::Feature& feature : *features)
      if (const auto p_W = positions_W.find(feature.track); p_W != positions_W.end())
        feature.depth_m = std::max(0.0, (T_CW[static_cast<std::size_t>(feature.camera)] * p_W->second).z());
  return view;
}

}  // namespace fbvins
