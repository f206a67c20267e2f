// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/frame_scatter.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

/// The largest part of what is known of a combination of parameters that one stamp is taken to have contributed.
constexpr double kMostOfOne = 0.9;

/// (C16) Covariance by leaving out each stamp, for a unit covariance L L^T, in the whitened parameters L^-1 x.
Eigen::MatrixXd scatter_of(std::span<const RigAdjustment::Evidence> frames, const Eigen::MatrixXd& L) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(L.cols(), L.cols());
  for (const RigAdjustment::Evidence& frame : frames) {
    const Eigen::MatrixXd share = L.transpose() * frame.information * L;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(share);
    const Eigen::VectorXd others = 1 - eigen.eigenvalues().array().min(kMostOfOne);
    const Eigen::VectorXd gradient = eigen.eigenvectors().transpose() * (L.transpose() * frame.gradient);
    const Eigen::VectorXd moved = eigen.eigenvectors() * gradient.cwiseQuotient(others);
    sum.noalias() += moved * moved.transpose();
  }
  return sum;
}

/// What of a sample of `frames` covariances is more than chance: eigenvalues above those that the noise of corners alone gives
/// (Marchenko and Pastur 1967) are kept, all others are their mean, at least 1.
Eigen::MatrixXd more_than_chance(const Eigen::MatrixXd& sample, std::size_t frames) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(sample);
  const double edge = std::pow(1 + std::sqrt(static_cast<double>(sample.rows()) / static_cast<double>(frames)), 2);
  Eigen::VectorXd values = eigen.eigenvalues();
  double sum = 0;
  int usual = 0;
  for (const double value : values)
    if (value <= edge) sum += value, ++usual;
  const double mean = usual > 0 ? std::max(1.0, sum / usual) : 1;
  for (double& value : values) value = value > edge ? value : mean;
  return eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace

Eigen::MatrixXd covariance_by_scatter(std::span<const RigAdjustment::Evidence> frames, const Eigen::MatrixXd& unit,
                                      double noise_px) {
  const double variance = noise_px * noise_px;
  if (!(variance > 0)) return variance * unit;
  const Eigen::VectorXd scale = unit.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::MatrixXd correlation = scale.cwiseInverse().asDiagonal() * unit * scale.cwiseInverse().asDiagonal();
  // Not by Cholesky: combinations may be known ten million times worse than others.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(correlation);
  const Eigen::VectorXd roots = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
  const Eigen::MatrixXd L = scale.asDiagonal() * eigen.eigenvectors() * roots.asDiagonal();
  return variance * (L * more_than_chance(scatter_of(frames, L) / variance, frames.size()) * L.transpose());
}

}  // namespace fbvins
