// SPDX-License-Identifier: Apache-2.0
// Angles are radians everywhere; where degrees read better, they are written as a product.
//
//   double max_turn_rad = 65 * kDegree;
#pragma once

#include <numbers>

namespace fbvins {

inline constexpr double kDegree = std::numbers::pi / 180;  ///< rad
inline constexpr double kDegreesPerRad = 180 / std::numbers::pi;

}  // namespace fbvins
