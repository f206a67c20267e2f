// SPDX-License-Identifier: Apache-2.0
// A lens model of one's own, beside those of lens_models.hpp: a camera behind it flies, maps and relocalises as others do.
//
//   struct ScanLens : Lens { ... };
//   Camera camera(std::make_shared<const ScanLens>(table), 640, 480);
//
// Const members may be called from any thread.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

/// The image radius has to grow with the angle from the axis, up to the widest at which project() gives a pixel. A calibration in
/// a file, `fbvins calibrate` and the corrections of `fbvins doctor` know the models of lens_models.hpp only.
class Lens {
 public:
  virtual ~Lens() = default;
  virtual std::string name() const = 0;
  /// fx, fy, cx, cy of the pinhole that is like it near the axis, px.
  virtual std::array<double, 4> intrinsics() const = 0;
  /// Pixel of a point in the camera's frame (z forward, x right, y down), m; nullopt outside of the model's domain.
  /// J_pixel_point, if given, receives d(pixel)/d(point), px/m.
  virtual std::optional<Vec2> project(const Vec3& p_C, Eigen::Matrix<double, 2, 3>* J_pixel_point) const = 0;
  /// Direction of a pixel, of any length; nullopt where the lens has none.
  virtual std::optional<Vec3> ray(const Vec2& pixel) const = 0;
};

}  // namespace fbvins
