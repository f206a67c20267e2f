// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/lens_change.hpp"

#include <cmath>
#include <utility>

#include "fbvins/camera/lens_numbers.hpp"

namespace fbvins {

namespace {

std::pair<double*, double*> radial_numbers(DoubleSphere& m) { return {&m.xi, &m.alpha}; }
std::pair<double*, double*> radial_numbers(ExtendedUnified& m) { return {&m.alpha, &m.beta}; }
std::pair<double*, double*> radial_numbers(auto& m) { return {&m.k1, &m.k2}; }

}  // namespace

RadialNames radial_names(const Camera& camera) {
  if (std::holds_alternative<DoubleSphere>(camera.model())) return {"xi", "alpha"};
  if (std::holds_alternative<ExtendedUnified>(camera.model())) return {"alpha", "beta"};
  return {"k1", "k2"};
}

Camera changed(const Camera& camera, const LensChange& change) {
  auto model = camera.model();
  std::visit(
      [&](auto& m) {
        m.fx *= std::exp(change.log_focal);
        m.fy *= std::exp(change.log_focal);
        m.cx += change.centre_px.x();
        m.cy += change.centre_px.y();
        const auto [first, second] = radial_numbers(m);
        *first += change.radial.x();
        *second += change.radial.y();
      },
      model);
  return camera.with_lens(model);
}

bool in_range(const Camera& camera) { return outside_of_model(camera.model_name(), camera.distortion()).empty(); }

}  // namespace fbvins
