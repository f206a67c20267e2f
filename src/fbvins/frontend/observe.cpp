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

std::optional<Observation> observe(const Camera& camera, const Vec2& px, double sigma_px) {
  const std::optional<Vec2> normalised = camera.undistort(px);
  if (!normalised) return std::nullopt;
  return observe(camera, px, *normalised, sigma_px);
}

Observation observe_depth(const Vec2& px, const Vec2& left_normalised, const MeasuredInverseDepth& depth) {
  Observation observation;
  observation.pixel = px;
  observation.normalised = left_normalised - Vec2(kDepthBaseline_m * depth.value, 0);
  observation.sqrt_information = Vec2(1 / (kDepthBaseline_m * depth.sigma), 0).asDiagonal();
  return observation;
}

double baseline_for_depths_m(const StereoRig& rig) {
  constexpr double kDisparity_px = 0.4;
  return rig.depth ? kDisparity_px / (rig.left().focal_px() * rig.depth->noise_at_1m_m) : rig.T_C1C0().p.norm();
}

}  // namespace fbvins
