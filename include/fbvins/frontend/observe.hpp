// SPDX-License-Identifier: Apache-2.0
// Observations of features for the estimator, with their weights. Pure functions.
//
//   feature.see(0, observe(rig.left(), px, 0.5));   // by camera 0, found to half a pixel; nothing where the lens has no ray
#pragma once

#include <optional>

#include "fbvins/camera/depth_reader.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// `sigma_px`: standard deviation of the position in the raw image.
Observation observe(const Camera& camera, const Vec2& px, const Vec2& normalised, double sigma_px);
/// The same of a pixel alone; nothing where the lens has no ray for it.
std::optional<Observation> observe(const Camera& camera, const Vec2& px, double sigma_px);

/// A depth measured at a pixel of the left camera, as C1 sees it (StereoRig::depth): across the baseline only.
Observation observe_depth(const Vec2& px, const Vec2& left_normalised, const MeasuredInverseDepth& depth);

/// The baseline of a stereo pair that measures depths as well as the rig does, m.
double baseline_for_depths_m(const StereoRig& rig);

/// The tracks observed in the newest image, in their order.
template <class Tracks>
std::vector<TrackedFeature> features_of(const Tracks& tracks, const Camera& left, double sigma_px) {
  std::vector<TrackedFeature> features;
  features.reserve(tracks.size());
  for (const auto& track : tracks) {
    if (!track.observed) continue;
    TrackedFeature feature;
    feature.id = track.id;
    feature.age_frames = track.age_frames;
    feature.see(0, observe(left, track.px, track.normalised, sigma_px));
    feature.see(1, track.right);
    features.push_back(feature);
  }
  return features;
}

}  // namespace fbvins
