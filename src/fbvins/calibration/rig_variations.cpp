// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/rig_variations.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "fbvins/calibration/lens_jacobian.hpp"

namespace fbvins {
namespace {

/// Cameras that were calibrated each by itself have none.
bool has_extrinsics(const CameraCalibration& rig, std::size_t camera) {
  return std::ranges::find(rig.names, fmt::format("cam{}.px", camera)) != rig.names.end();
}

/// `step` in the order of CameraCalibration::names.
RigVariation varied(const CameraCalibration& rig, const Eigen::VectorXd& step) {
  RigVariation out;
  Eigen::Index next = 0;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const Camera& camera = rig.cameras[c].camera;
    std::vector<double> lens = lens_parameters(camera.model());
    for (double& x : lens) x += step(next++);
    out.cameras.emplace_back(with_parameters(camera.model(), lens.data()), camera.width(), camera.height());
    out.T_CnC0.push_back(rig.cameras[c].T_CnC0);
    if (!has_extrinsics(rig, c)) continue;
    out.T_CnC0.back() = out.T_CnC0.back().boxplus(step.segment<3>(next), step.segment<3>(next + 3));
    next += 6;
  }
  return out;
}

}  // namespace

std::vector<RigVariation> rig_variations(const CameraCalibration& cameras) {
  // Scaled to correlations first, so that small numbers (metres) are resolved as well as large ones (pixels).
  const Eigen::VectorXd sigma = cameras.covariance.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::MatrixXd correlation = sigma.cwiseInverse().asDiagonal() * cameras.covariance * sigma.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(correlation);
  std::vector<RigVariation> out;
  for (Eigen::Index k = 0; k < sigma.size(); ++k) {
    const double size = std::sqrt(std::max(0.0, eigen.eigenvalues()(k))) * RigVariation{}.sigmas;
    out.push_back(varied(cameras, size * sigma.cwiseProduct(eigen.eigenvectors().col(k))));
  }
  return out;
}

}  // namespace fbvins
