// SPDX-License-Identifier: Apache-2.0
// How well a calibration knows where a ray meets the image, place by place: what the covariance of a lens's parameters, which
// trade off against one another, means for its user. Pure function, any thread.
//
//   std::vector<double> sigma_px = lens_certainty(found, 0, ImageCells::of(camera), used);
//
// A lens that is turned in its mount and a camera that is turned are the same to all who use it: of a change of the parameters
// that rotation is taken out which explains most of it in the cells `used`.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/calibration/residual_summary.hpp"

namespace fbvins {

/// How pixels move with a lens's parameters, at the centre of each cell, without that turn.
class LensMotions {
 public:
  LensMotions(const Camera& lens, const ImageCells& grid, const std::vector<bool>& used);
  /// By the covariance of the lens's parameters, as lens_certainty() gives it.
  std::vector<double> sigma_px(const Eigen::MatrixXd& covariance) const;

 private:
  std::vector<std::optional<Eigen::Matrix<double, 2, Eigen::Dynamic>>> cells_;  ///< none: the lens has no ray there
};

/// Standard deviation of a coordinate, px, at the centre of each cell; not a number where the lens has no ray.
std::vector<double> lens_certainty(const CameraCalibration& found, int camera, const ImageCells& grid,
                                   const std::vector<bool>& used);

}  // namespace fbvins
