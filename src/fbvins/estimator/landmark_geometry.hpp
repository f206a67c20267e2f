// SPDX-License-Identifier: Apache-2.0
// Triangulation of landmarks and change of their host (docs/derivations/window.md, W1-W4). Pure functions.
#pragma once

#include <span>

#include "fbvins/estimator/frame_list.hpp"
#include "fbvins/estimator/landmark_table.hpp"

namespace fbvins {

/// Range of triangulation: a landmark that would be nearer is refused, one that would be farther is put at the limit.
inline constexpr double kNearestLandmark_m = 0.1, kFarthestLandmark_m = 200;

/// Finds (alpha, beta, rho) on the ray of its first observation, its host's; false, and nothing changed,
/// where its depth is too uncertain, out of range, or inconsistent with an observation.
bool triangulate(Landmark& landmark, const FrameList& frames, const Calibration& calibration);

/// The landmark in its lead in a frame, times its inverse depth (W2, W3).
Vec3 scaled_point_in_camera(const Landmark& landmark, const Frame& target, const FrameList& frames,
                            const Calibration& calibration);

/// Puts the same point on a ray of another frame, of its first observation there; no longer triangulated where it is behind
/// that frame's camera.
void rehost(Landmark& landmark, FrameId new_host, const FrameList& frames, const Calibration& calibration);

/// Sets the velocities of the observations in two consecutive frames, `gap_s` apart.
void set_velocities(std::span<Sighting> before, std::span<Sighting> now, double gap_s);

}  // namespace fbvins
