// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/opencv_lens.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "fbvins/core/hypotenuse.hpp"

namespace fbvins {
namespace {

constexpr double kMostIgnored_px = 0.1;  ///< by which terms that our models lack may move a pixel
constexpr std::size_t kRational = 8, kThinPrism = 12, kTilted = 14;

/// Without zeros at the end, but as long as one of the forms of up to eight.
std::vector<double> shortest_form(std::vector<double> k) {
  while (!k.empty() && k.back() == 0) k.pop_back();
  k.resize(k.size() <= 4 ? 4 : k.size() <= 5 ? 5 : std::max(k.size(), kRational), 0.0);
  return k;
}

/// The plane of the sensor tilted by two angles, as OpenCV defines it: a homography of the image plane that keeps the axis.
Mat3 tilt_homography(double tau_x, double tau_y) {
  const Mat3 about_x = (Mat3() << 1, 0, 0, 0, std::cos(tau_x), std::sin(tau_x), 0, -std::sin(tau_x), std::cos(tau_x)).finished();
  const Mat3 about_y = (Mat3() << std::cos(tau_y), 0, -std::sin(tau_y), 0, 1, 0, std::sin(tau_y), 0, std::cos(tau_y)).finished();
  const Mat3 R = about_y * about_x;
  const Mat3 onto = (Mat3() << R(2, 2), 0, -R(0, 2), 0, R(2, 2), -R(1, 2), 0, 0, 1).finished();
  return onto * R;
}

/// The farthest that thin prism and tilt move a pixel of the image.
double ignored_px(const Camera& camera, const std::vector<double>& k) {
  const auto [fx, fy, cx, cy] = camera.intrinsics();
  const Mat3 tilt = k.size() >= kTilted ? tilt_homography(k[12], k[13]) : Mat3(Mat3::Identity());
  constexpr int kParts = 16;
  double most = 0;
  for (int i = 0; i <= kParts; ++i)
    for (int j = 0; j <= kParts; ++j) {
      const Vec2 pixel((camera.width() - 1) * static_cast<double>(i) / kParts,
                       (camera.height() - 1) * static_cast<double>(j) / kParts);
      const auto n = camera.undistort(pixel);
      if (!n) continue;
      const double s = n->squaredNorm();
      const Vec2 plane((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
      const Vec2 prism(k[8] * s + k[9] * s * s, k[10] * s + k[11] * s * s);
      const Vec2 moved = Vec2((tilt * (plane + prism).homogeneous()).hnormalized()) - plane;
      most = std::max(most, hypotenuse(fx * moved.x(), fy * moved.y()));
    }
  return most;
}

}  // namespace

DistortionKind distortion_kind(std::string_view name) {
  std::string plain;
  for (const char c : name)
    if (c != '_' && c != '-' && c != ' ') plain += static_cast<char>(c >= 'A' && c <= 'Z' ? c + 'a' - 'A' : c);
  const auto is = [&](std::initializer_list<const char*> names) { return std::ranges::find(names, plain) != names.end(); };
  if (is({"none", "pinhole", "distortion.none"})) return DistortionKind::none;
  if (is({"radtan", "radialtangential", "plumbbob", "rationalpolynomial", "rational", "brownconrady", "radtan5", "radtan8"}))
    return DistortionKind::brown;
  if (is({"equidistant", "fisheye", "kannalabrandt", "kannalabrandt4", "kannalabrandt8", "kb4"}))
    return DistortionKind::equidistant;
  return DistortionKind::unknown;
}

Result<Camera> opencv_camera(const std::array<double, 4>& f, const std::vector<double>& coefficients, int width, int height) {
  const std::size_t given = coefficients.size();
  if (given != 0 && given != 4 && given != 5 && given != kRational && given != kThinPrism && given != kTilted)
    return Error{ErrorCode::malformed, fmt::format("has {} numbers where 4, 5, 8, 12 or 14 are known", given)};
  if (!std::ranges::all_of(coefficients, [](double x) { return std::isfinite(x); }))
    return Error{ErrorCode::malformed, "holds something that is not a number"};
  std::vector<double> k = shortest_form(coefficients);
  const double* own = k.data();
  Camera camera(k.size() == 4   ? LensModel(PinholeRadtan{f[0], f[1], f[2], f[3], own[0], own[1], own[2], own[3]})
                : k.size() == 5 ? LensModel(PinholeRadtan5{f[0], f[1], f[2], f[3], own[0], own[1], own[2], own[3], own[4]})
                                : LensModel(PinholeRational{f[0], f[1], f[2], f[3], own[0], own[1], own[2], own[3], own[4],
                                                            own[5], own[6], own[7]}),
                width, height);
  if (k.size() <= kRational) return camera;
  k.resize(kTilted, 0.0);
  if (const double moved = ignored_px(camera, k); !(moved <= kMostIgnored_px))
    return Error{ErrorCode::unsupported,
                 fmt::format("its {} move pixels by up to {:.2g} px, and lenses are known up to the rational model of 8 numbers: "
                             "calibrate with `fbvins calibrate`, or without these terms",
                             k[12] != 0 || k[13] != 0 ? "thin prism (s1 to s4) and tilt" : "thin prism (s1 to s4)", moved)};
  // Without the terms that do not matter.
  k.resize(kRational);
  return opencv_camera(f, k, width, height);
}

Result<Camera> fisheye_camera(const std::array<double, 4>& f, const std::vector<double>& coefficients, int width, int height) {
  std::vector<double> k = coefficients;
  if ((k.size() < 4 && !k.empty()) ||
      !std::all_of(k.begin() + std::min<std::ptrdiff_t>(4, std::ssize(k)), k.end(), [](double x) { return x == 0; }))
    return Error{ErrorCode::malformed, fmt::format("has {} numbers where 4 are needed", k.size())};
  k.resize(4, 0.0);
  return Camera(KannalaBrandt{f[0], f[1], f[2], f[3], k[0], k[1], k[2], k[3]}, width, height);
}

OpencvCoefficients opencv_coefficients(const Camera& camera) {
  const std::string name = camera.model_name();
  std::vector<double> k = camera.distortion();
  if (name == "pinhole-equidistant") return {"equidistant", k};
  if (name == "pinhole-rational") return {"rational_polynomial", k};
  if (name != "pinhole-radtan" && name != "pinhole-radtan5") return {name, k};
  k.resize(5, 0.0);
  return {"plumb_bob", k};
}

}  // namespace fbvins
