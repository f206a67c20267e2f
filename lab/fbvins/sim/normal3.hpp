// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "fbvins/core/rng.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// Three independent normal deviates of that standard deviation.
inline Vec3 normal3(Rng& rng, double sigma) {
  const double x = rng.normal(), y = rng.normal(), z = rng.normal();
  return sigma * Vec3(x, y, z);
}

}  // namespace fbvins
