// SPDX-License-Identifier: Apache-2.0
// Private: names and order of lens parameters in calibration files. Pure functions, any thread.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/camera/camera.hpp"

namespace fbvins {

/// A camera as Kalibr writes it: intrinsics are xi, alpha of ds, alpha, beta of eucm, xi of omni, then fu, fv, pu, pv.
struct KalibrCamera {
  std::string model;
  std::vector<double> intrinsics;
  std::string distortion;
  std::vector<double> coefficients;
};
KalibrCamera kalibr_camera(const Camera& camera);

/// The lens of Camera::model_name(), Camera::intrinsics() and Camera::distortion(); nullopt for another name, another count of
/// numbers, or numbers that the model does not allow.
std::optional<LensModel> lens_of(std::string_view model_name, const std::array<double, 4>& intrinsics,
                                 const std::vector<double>& distortion);

/// Why Kalibr's model does not allow its own parameters (those listed before the focal lengths); empty if it does.
std::string outside_of_model(const std::string& model, const std::vector<double>& own);

}  // namespace fbvins
