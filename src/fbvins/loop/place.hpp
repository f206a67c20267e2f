// SPDX-License-Identifier: Apache-2.0
// What a map remembers of an image: descriptors, where they were seen, and how far away. Values.
#pragma once

#include <vector>

#include "fbvins/features/keypoint.hpp"
#include "fbvins/geometry/pose.hpp"
#include "fbvins/loop/vocabulary.hpp"

namespace fbvins {

/// One feature of the left camera. Positions are normalised (x/z, y/z in C0), so a place needs no lens model.
struct PlaceFeature {
  float x = 0, y = 0;
  float inverse_depth = -1;       ///< 1/m along z of C0; negative: not known
  float sigma_xy = 0;             ///< standard deviation of x and of y
  float sigma_inverse_depth = 0;  ///< 1/m

  bool has_depth() const { return inverse_depth >= 0; }
  /// Far enough from infinity to be a point.
  bool has_point() const {
    constexpr float kFarthest_1pm = 1e-3f, kMaxRelativeSigma = 0.5f;
    return inverse_depth > kFarthest_1pm && sigma_inverse_depth < kMaxRelativeSigma * inverse_depth;
  }
  Vec2 xy() const { return {x, y}; }
  /// In C0, m; only with has_point().
  Vec3 p_C0() const { return Vec3(x, y, 1) / inverse_depth; }
  bool operator==(const PlaceFeature&) const = default;
};

struct Place {
  std::vector<Descriptor> descriptors;
  std::vector<PlaceFeature> features;  ///< feature i has descriptor i
  BowVector words;
  Vec3 up_C0 = Vec3::UnitZ();  ///< the vertical, upwards, as the odometry estimates it at present
  double focal_px = 460;       ///< pixels per unit of normalised coordinates

  std::size_t size() const { return features.size(); }
};

}  // namespace fbvins
