// SPDX-License-Identifier: Apache-2.0
// Lens models as functions of their parameters: what a calibration varies. Pure functions, any thread.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/camera/lens_projection.hpp"

namespace fbvins {

/// fx, fy, cx, cy, then the others in the order of the model's struct.
std::vector<double> lens_parameters(const LensModel& lens);
int lens_parameter_count(const LensModel& lens);
std::vector<std::string> lens_parameter_names(const LensModel& lens);
/// The same model with other numbers, moved to the nearest that the model allows.
LensModel with_parameters(const LensModel& lens, const double* parameters);

/// The parameters in another form, whose errors are nearly those of a linear problem: of ds and omni the focal lengths near the
/// axis, f / (1 + xi), in place of f, and of omni and the rational model the coefficients of the whole radial function in place
/// of k1, k2 and, of the latter, k3. The models' own parameters trade off against one another along a bent valley. The others' as
/// they are.
std::vector<double> straight_parameters(const LensModel& lens);
/// d(straight_parameters)/d(parameters).
Eigen::MatrixXd straight_jacobian(const LensModel& lens);

/// The lens after a step of its parameters, along the curve that begins in the step's direction and is a line in straight
/// parameters: an adjustment converges in a few iterations instead of hundreds.
LensModel moved_lens(const LensModel& lens, const double* step);

/// Names of all models, as Camera::model_name() gives them.
std::vector<std::string> lens_names();
/// A lens of that model with focal length and centre, and no distortion (ds, eucm: alpha 0.5; omni: xi 1); nullopt for another
/// name.
std::optional<LensModel> plain_lens(std::string_view name, double focal_px, const Vec2& centre_px);

}  // namespace fbvins
