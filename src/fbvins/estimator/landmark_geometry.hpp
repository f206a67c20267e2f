// SPDX-License-Identifier: Apache-2.0
// Where a landmark is, from the frames that see it (docs/derivations/window.md, W1-W4). Pure functions.
#pragma once

#include "fbvins/estimator/frame_list.hpp"
#include "fbvins/estimator/landmark_table.hpp"

namespace fbvins {

/// No landmark is nearer than this; one further off than kFarthestLandmark_m is kept there.
inline constexpr double kNearestLandmark_m = 0.1, kFarthestLandmark_m = 200;

/// Finds (alpha, beta, rho) on the ray of its first sighting, its host's; false, and nothing changed, where its depth is not
/// known well enough, out of range, or at odds with a sighting.
bool triangulate(Landmark& landmark, const FrameList& frames, const Calibration& calibration);

/// The landmark in the left camera of a frame, times its inverse depth (W2, W3).
Vec3 scaled_point_in_camera(const Landmark& landmark, const Frame& target, const FrameList& frames,
                            const Calibration& calibration);

/// The same point on a ray of another frame; no longer triangulated where that frame has it behind its camera.
void rehost(Landmark& landmark, FrameId new_host, const FrameList& frames, const Calibration& calibration);

/// Velocities of two sightings that follow one another, `gap_s` apart.
void set_velocities(Sighting& before, Sighting& now, double gap_s);

}  // namespace fbvins
