// SPDX-License-Identifier: Apache-2.0
// Residuals of a calibration of cameras, gathered for people: by place in the image, distance from the centre, angle of incidence
// and time. What a wrong lens model, a bent board or blurred images leave behind has a pattern in one of them; noise has none.
// Pure function, any thread.
//
//   for (const CameraResiduals& camera : summarise_residuals(found)) plot(camera.by_radius);
#pragma once

#include <vector>

#include "fbvins/calibration/camera_calibration.hpp"

namespace fbvins {

/// An image divided into nearly square cells, row by row from the top left.
struct ImageCells {
  int columns = 0, rows = 0;
  double width_px = 0, height_px = 0;  ///< of the image

  static ImageCells of(const Camera& camera) { return of(camera.width(), camera.height()); }
  static ImageCells of(double width_px, double height_px);
  int count() const { return columns * rows; }
  int cell_of(const Vec2& pixel) const;  ///< the nearest, where the pixel lies outside
  Vec2 centre(int cell) const;
};

struct ResidualCell {
  int corners = 0;
  Vec2 mean_px = Vec2::Zero();  ///< detected minus predicted
};

/// Of corners between two distances or angles.
struct ResidualBin {
  double from = 0, to = 0;
  int corners = 0;
  double rms_px = 0;       ///< of a coordinate
  double outwards_px = 0;  ///< mean of the residuals' part away from the principal point
};

struct ViewResidual {
  Time t;
  int corners = 0;
  double rms_px = 0;
};

struct CameraResiduals {
  ImageCells grid;
  std::vector<ResidualCell> cells;
  std::vector<ResidualBin> by_radius;  ///< px from the principal point
  std::vector<ResidualBin> by_angle;   ///< rad between ray and optical axis, of rays that look forwards
  std::vector<ViewResidual> by_view;   ///< in order of time
};

std::vector<CameraResiduals> summarise_residuals(const CameraCalibration& found);

}  // namespace fbvins
