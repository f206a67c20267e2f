// SPDX-License-Identifier: Apache-2.0
// Queries on a window and copies of its contents for others. Pure functions.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/estimator/pose_refinement.hpp"
#include "fbvins/estimator/sliding_window.hpp"
#include "fbvins/types/keyframe.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

/// Number of triangulated landmarks seen in the newest frame and in another one.
int landmarks_in_view(const SlidingWindow& window);

/// The tracks of triangulated landmarks seen in the newest frame and in two other ones.
std::vector<TrackId> tracks_in_view(const SlidingWindow& window);

/// The landmarks of the window whose tracks are among these features, with their estimated positions. The features must outlive
/// them.
std::vector<LandmarkObservation> landmark_observations(const SlidingWindow& window, const std::vector<TrackedFeature>& features,
                                                       const Calibration& calibration);

/// Share of the newest frame's features that the last keyframe saw, and the median rotation-free
/// motion of these in px of a camera with this focal length.
struct KeyframeDistance {
  double shared_ratio = 0;
  double parallax_px = 0;
  Duration age;
};
KeyframeDistance distance_to_last_keyframe(const SlidingWindow& window, const Calibration& calibration, double focal_px);

/// A state of the window with the vertical, without up_sigma_rad.
GaugeState gauge_state_of(const SlidingWindow& window, const NavState<G>& state);
/// Standard deviation of up's direction about its less certain axis, from WindowInformation::covariance().
double up_sigma_rad(const Mat17& covariance);

/// Motion of the body from the frame before to the newest one, predicted by the readings between them from the present estimate
/// of the frame before; without readings, as the window estimates it. None for the first frame.
/// `by_images`: as the window estimates it, whatever readings there are.
std::optional<Pose<B, B>> motion_of_newest(const SlidingWindow& window, const Vec3& gravity_G, bool by_images = false);

/// Mean turning rate from the oldest to the newest frame, in the body's axes, rad/s. Zero with fewer than two frames.
Vec3 mean_rate_B(const FrameList& frames);

/// The landmarks of the window that have a position.
std::vector<LocatedLandmark> located_landmarks(const SlidingWindow& window, const Calibration& calibration);

/// Frames and landmarks, levelled.
WindowSnapshot snapshot_of(const SlidingWindow& window, const Calibration& calibration);
/// A frame as a keyframe for loop closure, levelled, with its landmarks, but without its images.
Keyframe keyframe_of(const SlidingWindow& window, int frame, const Calibration& calibration);

}  // namespace fbvins
