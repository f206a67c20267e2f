// SPDX-License-Identifier: Apache-2.0
// Private: how far the images of a calibration contradict one another. The covariance of the normal equations takes the errors of
// corners as independent; a board that bends, cameras without a common trigger and what a lens model leaves move all corners of
// an image together. What the calibration would be without each stamp shows it (C16). Pure function.
#pragma once

#include <span>

#include "fbvins/calibration/rig_adjustment.hpp"

namespace fbvins {

/// Covariance of the parameters, from what each stamp says of them (RigAdjustment::evidence()). `unit`: by the normal equations
/// for a noise of 1 px; `noise_px`: of a corner's coordinate.
Eigen::MatrixXd covariance_by_scatter(std::span<const RigAdjustment::Evidence> frames, const Eigen::MatrixXd& unit,
                                      double noise_px);

}  // namespace fbvins
