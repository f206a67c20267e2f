// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/lens_certainty.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "fbvins/calibration/lens_jacobian.hpp"

namespace fbvins {
namespace {

/// How a pixel moves with the lens's parameters, and with a turn of the camera.
struct PixelMotion {
  Eigen::Matrix<double, 2, Eigen::Dynamic> lens;
  Eigen::Matrix<double, 2, 3> turn;
};

std::optional<PixelMotion> motion_at(const Camera& camera, const Vec2& pixel) {
  const std::optional<Vec2> xy = camera.undistort(pixel);
  if (!xy) return std::nullopt;
  const Vec3 ray = Vec3(xy->x(), xy->y(), 1).normalized();
  LensDerivatives d;
  if (!project_point(camera.model(), ray, &d)) return std::nullopt;
  return PixelMotion{d.parameters.leftCols(lens_parameter_count(camera.model())), -d.point * hat(ray)};
}

}  // namespace

LensMotions::LensMotions(const Camera& lens, const ImageCells& grid, const std::vector<bool>& used) {
  const int size = lens_parameter_count(lens.model());
  std::vector<std::optional<PixelMotion>> motions;
  Mat3 A = 1e-12 * Mat3::Identity();
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(3, size);
  for (int cell = 0; cell < grid.count(); ++cell) {
    motions.push_back(motion_at(lens, grid.centre(cell)));
    if (!motions.back() || !used[static_cast<std::size_t>(cell)]) continue;
    A += motions.back()->turn.transpose() * motions.back()->turn;
    B += motions.back()->turn.transpose() * motions.back()->lens;
  }
  const Eigen::MatrixXd turn_by_lens = A.ldlt().solve(B);
  for (const auto& motion : motions) {
    cells_.emplace_back();
    if (motion) cells_.back() = motion->lens - motion->turn * turn_by_lens;
  }
}

std::vector<double> LensMotions::sigma_px(const Eigen::MatrixXd& covariance) const {
  std::vector<double> out;
  for (const auto& J : cells_) out.push_back(J ? std::sqrt((*J * covariance * J->transpose()).trace() / 2) : std::nan(""));
  return out;
}

std::vector<double> lens_certainty(const CameraCalibration& found, int camera, const ImageCells& grid,
                                   const std::vector<bool>& used) {
  const Camera& lens = found.cameras[static_cast<std::size_t>(camera)].camera;
  const int size = lens_parameter_count(lens.model());
  const auto first = std::ranges::find(found.names, fmt::format("cam{}.fx", camera)) - found.names.begin();
  return LensMotions(lens, grid, used).sigma_px(found.covariance.block(first, first, size, size));
}

}  // namespace fbvins
