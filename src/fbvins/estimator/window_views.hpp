// SPDX-License-Identifier: Apache-2.0
// What others want to know of a window: pictures of it, taken without changing it. Pure functions.
#pragma once

#include <optional>

#include "fbvins/estimator/sliding_window.hpp"
#include "fbvins/types/keyframe.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

/// Triangulated landmarks seen in the newest frame.
int landmarks_in_view(const SlidingWindow& window);

/// Share of the newest frame's features that the last keyframe saw, and the median rotation-free
/// motion of these in px of a camera with this focal length.
struct KeyframeDistance {
  double shared_ratio = 0;
  double parallax_px = 0;
  Duration age;
};
KeyframeDistance distance_to_last_keyframe(const SlidingWindow& window, const Calibration& calibration, double focal_px);

/// A state of the window as it is, without how well up is known.
GaugeState gauge_state_of(const SlidingWindow& window, const NavState& state);
/// How well up is known about its less known axis, from WindowInformation::covariance().
double up_sigma_rad(const Mat17& covariance);

/// The body's way from the frame before to the newest one as the readings between them tell, from the state before as it is known
/// now; where there are no readings, as the window has it. None for the first frame.
std::optional<Pose<B, B>> motion_of_newest(const SlidingWindow& window, const Vec3& gravity_W);

/// Levelled, as is what follows.
WindowSnapshot snapshot_of(const SlidingWindow& window, const Calibration& calibration);
/// A frame as a keyframe for loop closure, with what it sees, but without its images.
Keyframe keyframe_of(const SlidingWindow& window, int frame, const Calibration& calibration);

}  // namespace fbvins
