// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/lens_change.hpp"

#include <cmath>

namespace fbvins {

Camera changed(const Camera& camera, const LensChange& change) {
  auto model = camera.model();
  std::visit(
      [&](auto& m) {
        m.fx *= std::exp(change.log_focal);
        m.fy *= std::exp(change.log_focal);
        m.cx += change.centre_px.x();
        m.cy += change.centre_px.y();
        m.k1 += change.radial.x();
        m.k2 += change.radial.y();
      },
      model);
  return {model, camera.width(), camera.height()};
}

}  // namespace fbvins
