// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/observe.hpp"

namespace fbvins {

Observation observe(const Camera& camera, const Vec2& px, const Vec2& normalised, double sigma_px) {
  Observation observation;
  observation.pixel = px;
  observation.normalised = normalised;
  Mat2 J_pixel_normalised;
  camera.distort(normalised, &J_pixel_normalised);
  observation.sqrt_information = J_pixel_normalised / sigma_px;
  return observation;
}

}  // namespace fbvins
