// SPDX-License-Identifier: Apache-2.0
// The noise of corners from distances between seen and predicted ones, outliers among them. Pure function.
#pragma once

#include <cmath>
#include <vector>

#include "fbvins/core/median.hpp"

namespace fbvins {

/// Standard deviation of a coordinate, in the unit of the distances: their median over that of a Rayleigh distribution. 0 of
/// none. Reorders them.
inline double coordinate_noise(std::vector<double>& distances) { return median(distances) / std::sqrt(2 * std::log(2.0)); }

}  // namespace fbvins
