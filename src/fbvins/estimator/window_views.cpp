// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_views.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "fbvins/core/median.hpp"
#include "fbvins/geometry/so3.hpp"
#include "fbvins/geometry/symmetric.hpp"

namespace fbvins {
namespace {

/// Distance of two positions of a feature in one camera, without the part of the rotation; normalised.
double parallax(const Mat3& R_ba, const Observation& a, const Observation& b) {
  const Vec3 p = R_ba * Vec3(a.normalised.x(), a.normalised.y(), 1);
  return (p.head<2>() / p.z() - b.normalised).norm();
}

/// In G.
Vec3 position_of(const Landmark& landmark, const FrameList& frames, const Calibration& calibration) {
  const Pose<G, C0> T_GC = frames.at(landmark.host).state.T_FB * calibration.T_BC(landmark.ray_camera);
  return T_GC * Vec3(Vec3(landmark.alpha_beta_rho.x(), landmark.alpha_beta_rho.y(), 1) / landmark.alpha_beta_rho.z());
}

}  // namespace

int landmarks_in_view(const SlidingWindow& window) {
  const FrameId newest = window.newest().id;
  const std::vector<Landmark>& landmarks = window.landmarks().all();
  return static_cast<int>(std::count_if(landmarks.begin(), landmarks.end(), [&](const Landmark& l) {
    return l.triangulated && l.observations.back().frame == newest && l.by_several_frames();
  }));
}

std::vector<TrackId> tracks_in_view(const SlidingWindow& window) {
  std::vector<TrackId> out;
  for (const Landmark& l : window.landmarks().all())
    if (l.triangulated && l.observations.back().frame == window.newest().id && l.frame_count() >= 3) out.push_back(l.track);
  return out;
}

std::vector<LandmarkObservation> landmark_observations(const SlidingWindow& window, const std::vector<TrackedFeature>& features,
                                                       const Calibration& calibration) {
  std::vector<LandmarkObservation> out;
  out.reserve(features.size());
  for (const TrackedFeature& feature : features) {
    const Landmark* landmark = window.landmarks().find(feature.id);
    if (landmark == nullptr || !landmark->triangulated) continue;
    out.push_back({position_of(*landmark, window.frames(), calibration), &feature});
  }
  return out;
}

KeyframeDistance distance_to_last_keyframe(const SlidingWindow& window, const Calibration& calibration, double focal_px) {
  KeyframeDistance out;
  const Frame& newest = window.newest();
  const FrameList& frames = window.frames();
  int last = frames.size() - 2;
  while (last >= 0 && !frames[last].keyframe) --last;
  if (last < 0) return out;
  const Frame& keyframe = frames[last];
  out.age = newest.t - keyframe.t;
  const auto rotation = [&](const Mat3& R_BC) -> Mat3 {
    return (newest.state.T_FB.R() * R_BC).transpose() * keyframe.state.T_FB.R() * R_BC;
  };
  std::vector<Mat3> R_new_last;  // of each camera
  for (int i = 0; i < calibration.camera_count(); ++i) R_new_last.push_back(rotation(calibration.T_BC(i).R()));
  const auto moved_px = [&](int camera, const Observation& from, const Observation& to) {
    return focal_px * parallax(R_new_last[static_cast<std::size_t>(camera)], from, to);
  };
  int seen = 0;
  std::vector<double> motion;
  for (const Landmark& l : window.landmarks().all()) {
    if (l.observations.back().frame != newest.id) continue;
    ++seen;
    const std::span<const Sighting> before = l.seen_by_cameras(keyframe.id);
    for (const Sighting& now : l.newest()) {  // the first camera that saw it both times
      const auto then = std::ranges::find_if(before, [&](const Sighting& s) { return s.seen.camera == now.seen.camera; });
      if (then == before.end()) continue;
      motion.push_back(moved_px(now.seen.camera, then->seen, now.seen));
      break;
    }
  }
  if (seen > 0) out.shared_ratio = static_cast<double>(motion.size()) / seen;
  out.parallax_px = median(motion);
  return out;
}

GaugeState gauge_state_of(const SlidingWindow& window, const NavState<G>& state) {
  GaugeState out;
  out.T_GB = state.T_FB;
  out.v_GB = state.v_FB;
  out.q_LG = window.tilt().q().conjugate();
  return out;
}

double up_sigma_rad(const Mat17& covariance) {
  return std::sqrt(std::max(0.0, largest_eigenvalue(covariance.bottomRightCorner<2, 2>())));
}

std::optional<Pose<B, B>> motion_of_newest(const SlidingWindow& window, const Vec3& gravity_G, bool by_images) {
  const FrameList& frames = window.frames();
  if (frames.size() < 2) return std::nullopt;
  const Frame& newest = frames.newest();
  const NavState<G>& before = frames[frames.size() - 2].state;
  const NavState<G> after = newest.imu && !by_images ? newest.imu->predict(before, gravity_G) : newest.state;
  return before.T_FB.inverse() * after.T_FB;
}

Vec3 mean_rate_B(const FrameList& frames) {
  if (frames.size() < 2) return Vec3::Zero();
  Vec3 turned = Vec3::Zero();
  for (int i = 1; i < frames.size(); ++i) turned += so3_log(frames[i - 1].state.T_FB.q.conjugate() * frames[i].state.T_FB.q);
  return turned / (frames.newest().t - frames.oldest().t).seconds();
}

std::vector<LocatedLandmark> located_landmarks(const SlidingWindow& window, const Calibration& calibration) {
  std::vector<LocatedLandmark> out;
  for (const Landmark& l : window.landmarks().all())
    if (l.triangulated) out.push_back({l.track, position_of(l, window.frames(), calibration)});
  return out;
}

WindowSnapshot snapshot_of(const SlidingWindow& window, const Calibration& calibration) {
  WindowSnapshot out;
  const Tilt& tilt = window.tilt();
  for (const Frame& f : window.frames()) out.frames.push_back({f.id, f.t, tilt.levelled(f.state.T_FB), f.keyframe});
  for (const Landmark& l : window.landmarks().all()) {
    if (!l.triangulated) continue;
    const Vec3 p_W = tilt.levelled(position_of(l, window.frames(), calibration));
    out.landmarks.push_back({l.id, l.track, p_W, l.frame_count()});
  }
  return out;
}

Keyframe keyframe_of(const SlidingWindow& window, int frame, const Calibration& calibration) {
  const Frame& f = window.frames()[frame];
  const NavState<W> level = window.tilt().levelled(f.state);
  Keyframe out;
  out.id = f.id;
  out.t = f.t;
  out.T_WB = level.T_FB;
  out.v_WB = level.v_FB;
  out.imu.bias = f.state.bias;
  for (const Landmark& l : window.landmarks().all()) {
    const std::span<const Sighting> seen = l.seen_by_cameras(f.id);
    if (!l.triangulated || seen.empty()) continue;
    const Vec3 p_C = scaled_point_in_camera(l, f, window.frames(), calibration) / l.alpha_beta_rho.z();
    const Observation& shown = seen.front().seen;
    out.landmarks.push_back({l.track, shown.pixel, calibration.T_BC(l.lead) * p_C, shown.camera});
  }
  return out;
}

}  // namespace fbvins
