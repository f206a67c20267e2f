// SPDX-License-Identifier: Apache-2.0
// How accurately lenses and extrinsics of a stereo pair are found from corners with noise, and whether the covariance is right:
// recordings of every lens model with several seeds, against exact truth (docs/experiments/calibration.md).
//
//   calibration_cameras [SEEDS [STAMPS [NOISE_px [FIRST_SEED [MODEL]]]]]      20 300 0.2 1001
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <string>
#include <vector>

#include "fbvins/calibration/simulated_board.hpp"

using namespace fbvins;

namespace {

/// Sums over the seeds of one lens model.
struct Row {
  double focal_px = 0, axial_px = 0, centre_px = 0, baseline_mm = 0, turn_deg = 0;  ///< the largest
  double focal_square = 0, centre_square = 0;
  double noise_low = 1e9, noise_high = 0;  ///< found over put in
  double nees_lens = 0, nees_extrinsic = 0, seconds = 0;
  double largest_sigmas = 0;
  int runs = 0, lenses = 0, refused = 0, beyond_3_sigma = 0, parameters = 0;
};

double nees(const CameraCalibration& found, const Eigen::VectorXd& error, Eigen::Index first, Eigen::Index count) {
  const Eigen::VectorXd e = error.segment(first, count);
  return e.dot(found.covariance.block(first, first, count, count).ldlt().solve(e)) / static_cast<double>(count);
}

/// In straight parameters: the models' own are no linear problem's where they trade off against one another.
double straight_nees(const LensModel& found, const LensModel& truth, const Eigen::MatrixXd& covariance) {
  const std::vector<double> got = straight_parameters(found), want = straight_parameters(truth);
  const Eigen::MatrixXd J = straight_jacobian(found);
  const Eigen::VectorXd e =
      Eigen::Map<const Eigen::VectorXd>(got.data(), J.rows()) - Eigen::Map<const Eigen::VectorXd>(want.data(), J.rows());
  return e.dot((J * covariance * J.transpose()).ldlt().solve(e)) / static_cast<double>(e.size());
}

void add(const CameraCalibration& found, const SimulatedRig& rig, double noise_px, Row& row) {
  const auto size = static_cast<Eigen::Index>(found.names.size());
  Eigen::VectorXd error(size);
  Eigen::Index at = 0;
  for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
    const std::vector<double> got = lens_parameters(found.cameras[k].camera.model()),
                              want = lens_parameters(rig.cameras[k].model());
    const auto count = static_cast<Eigen::Index>(got.size());
    for (Eigen::Index i = 0; i < count; ++i) error[at + i] = got[i] - want[i];
    row.nees_lens +=
        straight_nees(found.cameras[k].camera.model(), rig.cameras[k].model(), found.covariance.block(at, at, count, count));
    ++row.lenses;
    row.focal_px = std::max({row.focal_px, std::abs(error[at]), std::abs(error[at + 1])});
    row.axial_px = std::max(row.axial_px, std::abs(straight_parameters(found.cameras[k].camera.model())[0] -
                                                   straight_parameters(rig.cameras[k].model())[0]));
    row.centre_px = std::max({row.centre_px, std::abs(error[at + 2]), std::abs(error[at + 3])});
    row.focal_square += 0.5 * error.segment<2>(at).squaredNorm();
    row.centre_square += 0.5 * error.segment<2>(at + 2).squaredNorm();
    at += count;
    if (k == 0) continue;
    error.segment<3>(at) = found.cameras[k].T_CnC0.p - rig.T_CnC0[k].p;
    error.segment<3>(at + 3) = so3_log(rig.T_CnC0[k].q.conjugate() * found.cameras[k].T_CnC0.q);
    row.nees_extrinsic += nees(found, error, at, 6);
    row.baseline_mm = std::max(row.baseline_mm, 1e3 * error.segment<3>(at).norm());
    row.turn_deg = std::max(row.turn_deg, error.segment<3>(at + 3).norm() * 180 / std::numbers::pi);
    at += 6;
  }
  for (Eigen::Index i = 0; i < size; ++i) {
    const double sigmas = std::abs(error[i]) / std::sqrt(found.covariance(i, i));
    row.beyond_3_sigma += sigmas > 3;
    row.largest_sigmas = std::max(row.largest_sigmas, sigmas);
    ++row.parameters;
  }
  row.noise_low = std::min(row.noise_low, found.noise_px / noise_px);
  row.noise_high = std::max(row.noise_high, found.noise_px / noise_px);
  ++row.runs;
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 20, stamps = argc > 2 ? std::atoi(argv[2]) : 300;
  const double noise_px = argc > 3 ? std::atof(argv[3]) : 0.2;
  const int first_seed = argc > 4 ? std::atoi(argv[4]) : 1001;
  const Board board{.columns = 6, .rows = 6, .size_m = 0.088, .spacing = 0.3};
  fmt::print("{} seeds, {} stamps of two cameras, noise {} px\n", seeds, stamps, noise_px);
  fmt::print(
      "| model | focal px, rms (largest) | near the axis, largest | centre px, rms (largest) | baseline mm, largest | turn deg, largest | noise found / put in "
      "| NEES lens | NEES extrinsics | beyond 3 sigma | largest, sigmas | s |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  const std::string only = argc > 5 ? argv[5] : "";
  for (const Camera& left : example_cameras()) {
    if (!only.empty() && left.model_name() != only) continue;
    const SimulatedRig rig = simulated_stereo(left);
    Row row;
    for (int seed = first_seed; seed < first_seed + seeds; ++seed) {
      const SimulatedViews views = simulated_views(rig, board, stamps, noise_px, static_cast<std::uint64_t>(seed));
      const auto start = std::chrono::steady_clock::now();
      const auto found = calibrate_cameras(views.detections, board, {.models = {left.model_name()}});
      row.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      if (found) add(*found, rig, noise_px, row);
      else {
        ++row.refused;
        fmt::print(stderr, "{} seed {}: {}\n", left.model_name(), seed, found.error().message);
      }
    }
    const int runs = std::max(1, row.runs), lenses = std::max(1, row.lenses);
    fmt::print(
        "| {} | {:.3f} ({:.3f}) | {:.3f} | {:.3f} ({:.3f}) | {:.4f} | {:.5f} | {:.3f} to {:.3f} | {:.2f} | {:.2f} | {} of {} | {:.1f} | {:.2f} |\n",
        left.model_name(), std::sqrt(row.focal_square / lenses), row.focal_px, row.axial_px,
        std::sqrt(row.centre_square / lenses), row.centre_px, row.baseline_mm, row.turn_deg, row.noise_low, row.noise_high,
        row.nees_lens / lenses, row.nees_extrinsic / runs, row.beyond_3_sigma, row.parameters, row.largest_sigmas,
        row.seconds / seeds);
    std::fflush(stdout);
  }
  return 0;
}
