// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/view_maker.hpp"

#include <unordered_map>
#include <utility>

namespace fbvins {

void ViewMaker::add(const TrackedFrame& frame) {
  t_ = frame.t;
  features_.clear();
  features_.reserve(frame.features.size());
  for (const TrackedFeature& feature : frame.features)
    if (feature.left) features_.push_back({feature.id, feature.left->pixel, feature.age_frames, 0});
}

LiveView ViewMaker::view_of(const Odometry& o, double shutter_to_pose_ms) {
  LiveView view{o.t, shutter_to_pose_ms, {}, {}, {}};
  if (t_ == o.t) view.features = std::exchange(features_, {});
  if (!o.health.has_pose() || window_.frames.empty()) return view;
  const Pose<W, B>& T_WB_window = window_.frames.back().T_WB;
  // From the window's gauge to the published frame, in which poses are corrected in small steps.
  const Pose<W, W> to_published = o.T_WB * T_WB_window.inverse();
  const Pose<C0, W> T_C0W = (T_WB_window * T_BC0_).inverse();
  std::unordered_map<TrackId, double> depths_m;
  view.landmarks.reserve(window_.landmarks.size());
  for (const WindowSnapshot::Landmark& landmark : window_.landmarks) {
    view.landmarks.push_back({landmark.track, to_published * landmark.p_W});
    depths_m.emplace(landmark.track, (T_C0W * landmark.p_W).z());
  }
  for (const WindowSnapshot::Frame& frame : window_.frames)
    if (frame.keyframe) view.keyframes_W.push_back(to_published * frame.T_WB.p);
  for (LiveView::Feature& feature : view.features)
    if (const auto depth = depths_m.find(feature.track); depth != depths_m.end() && depth->second > 0)
      feature.depth_m = depth->second;
  return view;
}

}  // namespace fbvins
