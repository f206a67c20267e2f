// SPDX-License-Identifier: Apache-2.0
// How well a calibration knows where a ray meets the image, place by place: what the covariance of a lens's parameters, which
// trade off against one another, means for its user. Pure function, any thread.
//
//   std::vector<double> sigma_px = lens_certainty(found, 0, ImageCells::of(camera), used);
//
// A lens that is turned in its mount and a camera that is turned are the same to all who use it: of a change of the parameters
// that rotation is taken out which explains most of it in the cells `used`.
#pragma once

#include <vector>

#include "fbvins/calibration/residual_summary.hpp"

namespace fbvins {

/// Standard deviation of a coordinate, px, at the centre of each cell; not a number where the lens has no ray.
std::vector<double> lens_certainty(const CameraCalibration& found, int camera, const ImageCells& grid,
                                   const std::vector<bool>& used);

}  // namespace fbvins
