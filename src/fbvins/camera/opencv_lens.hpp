// SPDX-License-Identifier: Apache-2.0
// Private: lenses by OpenCV's list of coefficients, as camera_info, Kalibr's chains and makers' files have them: k1, k2, p1, p2,
// then k3, then k4, k5, k6, then the thin prism's s1 to s4, then the tilt of the sensor. Pure functions, any thread.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

/// What calibration files call a distortion; the same thing has many names.
enum class DistortionKind { none, brown, equidistant, unknown };
DistortionKind distortion_kind(std::string_view name);

/// By 0, 4, 5, 8, 12 or 14 coefficients, with the fewest that say the same: zeros at the end count nothing. An error, one
/// sentence without the file's name, for another number of them, or where thin prism and tilt move a pixel of the image by more
/// than 0.1 px.
Result<Camera> opencv_camera(const std::array<double, 4>& intrinsics, const std::vector<double>& coefficients, int width,
                             int height);

/// By k1 to k4 of OpenCV's fisheye; zeros after the fourth count nothing.
Result<Camera> fisheye_camera(const std::array<double, 4>& intrinsics, const std::vector<double>& coefficients, int width,
                              int height);

/// OpenCV's coefficients of a lens that has some: of pinhole-radtan four, with k3 five, rational eight.
struct OpencvCoefficients {
  std::string ros_model;  ///< plumb_bob (always with k3), rational_polynomial, equidistant; of other lenses their own name
  std::vector<double> values;
};
OpencvCoefficients opencv_coefficients(const Camera& camera);

}  // namespace fbvins
