// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/weak_parts.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "fbvins/calibration/lens_certainty.hpp"
#include "fbvins/calibration/residual_summary.hpp"

namespace fbvins {
namespace {

constexpr double kTooMany_px = 1000;

/// Ninths of the image, row by row.
constexpr std::array<const char*, 9> kPlaces = {"top left", "top",         "top right", "left",        "middle",
                                                "right",    "bottom left", "bottom",    "bottom right"};

int ninth_of(const ImageCells& grid, int cell) {
  const Vec2 p = grid.centre(cell);
  return 3 * std::min(2, static_cast<int>(3 * p.y() / grid.height_px)) + std::min(2, static_cast<int>(3 * p.x() / grid.width_px));
}

/// The largest uncertainty in each ninth of the image.
void add_lens(const CameraCalibration& found, int camera, const CameraResiduals& seen, double aim_px,
              std::vector<WeakPart>& out) {
  std::vector<bool> used;
  for (const ResidualCell& cell : seen.cells) used.push_back(cell.corners > 0);
  const std::vector<double> sigma_px = lens_certainty(found, camera, seen.grid, used);
  std::array<double, 9> worst{};
  for (int cell = 0; cell < seen.grid.count(); ++cell) {
    double& most = worst[static_cast<std::size_t>(ninth_of(seen.grid, cell))];
    if (sigma_px[static_cast<std::size_t>(cell)] > most) most = sigma_px[static_cast<std::size_t>(cell)];
  }
  std::string places;
  double largest = 0;
  for (std::size_t i = 0; i < worst.size(); ++i) {
    if (worst[i] > aim_px) places += (places.empty() ? "" : ", ") + std::string(kPlaces[i]);
    largest = std::max(largest, worst[i]);
  }
  out.push_back({places.empty() ? fmt::format("cam{}'s lens", camera)
                                : fmt::format("cam{}'s lens in these parts of the image: {}", camera, places),
                 "px", std::min(largest, kTooMany_px), aim_px,
                 "bring the board there, near and far, tilted by 30 degrees and more to all sides"});
}

void add_baseline(const CameraCalibration& found, int camera, const CertaintyAims& aims, std::vector<WeakPart>& out) {
  const auto worst = [&](char kind) {
    double most = 0;
    for (const char axis : {'x', 'y', 'z'}) most = std::max(most, found.sigma(fmt::format("cam{}.{}{}", camera, kind, axis)));
    return most;
  };
  const char* advice = "hold the board where both cameras see it, near enough to fill their common view, for more images";
  if (std::ranges::find(found.names, fmt::format("cam{}.px", camera)) == found.names.end()) return;  // cam0, or by the IMU
  out.push_back({fmt::format("the place of cam{} beside cam0", camera), "mm", 1e3 * worst('p'), 1e3 * aims.baseline_m, advice});
  out.push_back({fmt::format("the rotation of cam{} against cam0", camera), "degrees", worst('r') / kDegree,
                 aims.between_cameras_rad / kDegree, advice});
}

/// The standard deviation in the worst direction, and the axes of the IMU about which to turn: those across it.
struct Worst {
  double sigma = 0;
  std::string across;
};

Worst worst_direction(const Mat3& P) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(P);
  Eigen::Index axis = 0;
  eigen.eigenvectors().col(2).cwiseAbs().maxCoeff(&axis);
  const std::array<const char*, 3> across = {"y and z", "x and z", "x and y"};
  return {std::sqrt(std::max(0.0, eigen.eigenvalues()(2))), across[static_cast<std::size_t>(axis)]};
}

void add_mounting(const CameraImuResult& imu, std::size_t camera, const CertaintyAims& aims, std::vector<WeakPart>& out) {
  const Mat6& P = imu.cameras[camera].covariance;
  const Worst lever = worst_direction(P.topLeftCorner<3, 3>());
  out.push_back({fmt::format("the place of cam{} on the IMU", camera), "mm", 1e3 * lever.sigma, 1e3 * aims.lever_m,
                 fmt::format("turn faster, to and fro, about the IMU's {} axes", lever.across)});
  const Mat3 R = imu.cameras[camera].T_BC.R();
  const Worst turn = worst_direction(R * P.bottomRightCorner<3, 3>() * R.transpose());
  out.push_back({fmt::format("the rotation of cam{} on the IMU", camera), "degrees", turn.sigma / kDegree,
                 aims.mounting_rad / kDegree, fmt::format("turn more about the IMU's {} axes, and for longer", turn.across)});
}

void add_imu(const CameraImuResult& imu, const CertaintyAims& aims, std::vector<WeakPart>& out) {
  for (std::size_t k = 0; k < imu.cameras.size(); ++k) add_mounting(imu, k, aims, out);
  out.push_back({"the time offset", "ms", 1e3 * imu.time_offset_sigma_s, 1e3 * aims.time_offset_s,
                 "turn faster, and change the direction more often"});
  for (std::size_t k = 1; k < imu.cameras.size(); ++k)
    if (const double sigma_s = imu.cameras[k].later_sigma_s; sigma_s > 0)
      out.push_back({fmt::format("the time offset of cam{}", k), "ms", 1e3 * sigma_s, 1e3 * aims.time_offset_s,
                     "turn faster, and change the direction more often"});
  if (imu.line_delay_sigma_s > 0)
    out.push_back({"the line delay", "us", 1e6 * imu.line_delay_sigma_s, 1e6 * aims.line_delay_s,
                   "turn faster, about the camera's x and y axes"});
  const double gyro = imu.axes_sigma.gyro.maxCoeff(), accel = imu.axes_sigma.accel.maxCoeff();
  if (gyro > 0)
    out.push_back({"scale and axes of the gyroscope", "%", 100 * gyro, 100 * aims.imu_axes, "turn faster, about all three axes"});
  if (accel > 0)
    out.push_back({"scale and axes of the accelerometer", "%", 100 * accel, 100 * aims.imu_axes,
                   "turn the rig so far that each of its axes points up and down once"});
}

}  // namespace

std::vector<WeakPart> judged_parts(const CameraCalibration& found, const CameraImuResult* imu, const CertaintyAims& aims) {
  std::vector<WeakPart> out;
  const std::vector<CameraResiduals> seen = summarise_residuals(found);
  for (int k = 0; k < static_cast<int>(seen.size()); ++k) {
    add_lens(found, k, seen[static_cast<std::size_t>(k)], aims.lens_px, out);
    add_baseline(found, k, aims, out);
  }
  if (imu != nullptr) add_imu(*imu, aims, out);
  return out;
}

std::vector<WeakPart> weak_parts(const CameraCalibration& found, const CameraImuResult* imu, const CertaintyAims& aims) {
  std::vector<WeakPart> out = judged_parts(found, imu, aims);
  std::erase_if(out, [](const WeakPart& part) { return part.sigma <= part.aim; });
  return out;
}

std::string sentence(const WeakPart& part) {
  return fmt::format("{} is known to {:.2g} {} only, where {:.2g} {} are wanted: {}", part.what, part.sigma, part.unit, part.aim,
                     part.unit, part.advice);
}

}  // namespace fbvins
