// SPDX-License-Identifier: Apache-2.0
// Two views of one picture with known correspondence, degraded as in flight: for training and evaluating the
// booster. The second view is the first through a random homography; both pass a camera with gain, gamma,
// shot noise, motion blur, defocus and uneven light. Same seed, same bytes. Pure functions.
//
//   Rng rng(7);
//   WarpedPair pair = make_warped_pair(photo.view(), Condition::low_light, rng);
//   Vec2 in_b = transfer(pair.H_ba, in_a);
#pragma once

#include <array>
#include <string_view>

#include "fbvins/core/rng.hpp"
#include "fbvins/geometry/so3.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// What differs between the two views, named as in the table of bench/features.
enum class Condition { small_motion, viewpoint, light, low_light, all };
inline constexpr std::array<std::string_view, 5> kConditionNames = {"small motion", "viewpoint", "light change",
                                                                    "low light and blur", "all at once"};

struct WarpedPair {
  Image a, b;
  Mat3 H_ba = Mat3::Identity();  ///< pixels of a to pixels of b
};

WarpedPair make_warped_pair(const ImageView& picture, Condition condition, Rng& rng);

inline Vec2 transfer(const Mat3& H, const Vec2& px) { return (H * px.homogeneous()).hnormalized(); }

/// Degradation of one camera image.
struct Damage {
  double gain = 1, gamma = 1;
  double uneven_light = 0;  ///< largest relative change of brightness over the image
  double photons = 1e4;     ///< of a full-scale pixel: shot noise
  double read_noise = 0.7;  ///< grey values, after the gain
  double motion_px = 0, motion_angle_rad = 0, defocus_px = 0;
  double exposure = 1;  ///< light that reaches the sensor; the gain compensates part of the loss
};

/// Random degradation of the second view of a pair under that condition.
Damage random_damage(Condition condition, Rng& rng);

/// `picture` (grey 0..255) with that degradation.
Image damage(const ImageView& picture, const Damage& damage, Rng& rng);

/// A synthetic picture with the statistics of natural ones: overlapping shapes of all sizes, shaded and textured.
Image dead_leaves(int width, int height, Rng& rng);

}  // namespace fbvins
