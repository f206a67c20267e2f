// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera_fit.hpp"

#include <algorithm>
#include <map>

#include "fbvins/calibration/corner_noise.hpp"
#include "fbvins/core/median.hpp"
#include "fbvins/optim/levenberg_marquardt.hpp"

namespace fbvins {
namespace {

constexpr int kMostIterations = 40;
constexpr double kCornerOutlier_sigmas = 4, kReadingOutlier_sigmas = 6;
constexpr double kBlurred = 1.6;  // residuals of an image over those of the median one

}  // namespace

ImuCameraFit::ImuCameraFit(CalibrationStart start)
    : start_(std::move(start)), problem_(start_.data, start_.state, start_.setup) {}

double ImuCameraFit::worst_rms() const { return std::max(gyro_rms_, accel_rms_); }

bool ImuCameraFit::solve() {
  LmOptions lm;
  lm.max_iterations = kMostIterations;
  lm.initial_lambda = 1e-12;
  lm.max_retries = 10;
  lm.min_step = 1e-9;
  lm.min_decrease = 1e-3;
  const LmSummary summary = minimise(problem_, lm);
  iterations_ += summary.iterations;
  return summary.usable && summary.iterations < kMostIterations;
}

bool ImuCameraFit::judge() {
  judge_corners();
  judge_readings();
  problem_.linearise();
  if (covariance_ = problem_.calibration_covariance(); !covariance_) return false;
  const ResidualSums sums = problem_.residual_sums();
  CalibrationSetup setup = problem_.setup();
  setup.corner_sigma_px *= sums.corners.rms() * setup.image_factor;
  image_factor_ = sums.images.rms() / sums.corners.rms();
  setup.stamp_jitter_s = sums.stamp_jitter_s;
  setup.image_factor = image_factor_ > kImagesTogether ? image_factor_ : 1;
  gyro_rms_ = sums.gyro.rms() * setup.gyro_sigma_radps / start_.nominal_gyro_sigma_radps;
  accel_rms_ = sums.accel.rms() * setup.accel_sigma_mps2 / start_.nominal_accel_sigma_mps2;
  setup.gyro_sigma_radps = start_.nominal_gyro_sigma_radps * std::max(1.0, gyro_rms_);
  setup.accel_sigma_mps2 = start_.nominal_accel_sigma_mps2 * std::max(1.0, accel_rms_);
  problem_.change(setup);
  return true;
}

void ImuCameraFit::halve_spacing() {
  CalibrationState state = problem_.state();
  const double spacing_s = 0.5 * state.path.spacing_s();
  state.path = with_spacing(state.path, spacing_s);
  state.intervals_per_bias *= 2;
  const auto nodes = static_cast<std::size_t>((state.path.intervals() - 1) / state.intervals_per_bias + 2);
  state.biases.resize(nodes, state.biases.back());
  CalibrationSetup setup = problem_.setup();
  setup.gyro_sigma_radps = start_.nominal_gyro_sigma_radps, setup.accel_sigma_mps2 = start_.nominal_accel_sigma_mps2;
  for (std::size_t i = 0; i < start_.data.readings.size(); ++i) problem_.data().readings[i].used = start_.data.readings[i].used;
  problem_ = ImuCameraProblem(problem_.data(), std::move(state), std::move(setup));
}

void ImuCameraFit::judge_corners() {
  const double sigma_px = problem_.setup().corner_sigma_px;
  std::vector<std::vector<double>> errors;
  std::map<std::pair<int, double>, std::vector<double>> images;  // camera, time: groups of rows together
  for (const CalibrationView& view : problem_.data().views) {
    std::vector<double>& own = errors.emplace_back();
    std::vector<double>& image = images[{view.camera, view.t_s}];
    const double late_s = problem_.lateness_s(view);  // a stamp that is not exact makes no corner an outlier
    for (const WeightedCorner& corner : view.corners) {
      const auto e = problem_.corner_error(view, corner, late_s);
      own.push_back(e ? e->norm() / sigma_px : 1e9);
      image.push_back(own.back());
    }
  }
  // By the middle corner, so that outliers do not make an image a bad one.
  std::vector<double> all;
  for (auto& [key, image] : images) {
    image = {coordinate_noise(image)};
    all.push_back(image[0]);
  }
  const double typical = median_of(all);
  for (std::size_t v = 0; v < errors.size(); ++v) {
    CalibrationView& view = problem_.data().views[v];
    const double rms = images[{view.camera, view.t_s}][0];
    view.noise_factor = rms > kBlurred * typical ? rms / typical : 1;
    for (std::size_t i = 0; i < view.corners.size(); ++i)
      view.corners[i].used = errors[v][i] <= kCornerOutlier_sigmas * view.noise_factor * typical;
  }
}

void ImuCameraFit::judge_readings() {
  std::vector<CalibrationReading>& readings = problem_.data().readings;
  std::vector<double> gyro, accel;
  for (const CalibrationReading& reading : readings) {
    const Vec6 r = problem_.reading_error(reading);
    gyro.push_back(r.head<3>().norm()), accel.push_back(r.tail<3>().norm());
  }
  // The median of the norm of three standard normal numbers is 1.538.
  const auto typical = [](const std::vector<double>& all) { return std::max(1.0, median_of(all) / 1.538); };
  const double gyro_limit = kReadingOutlier_sigmas * typical(gyro), accel_limit = kReadingOutlier_sigmas * typical(accel);
  for (std::size_t i = 0; i < readings.size(); ++i)
    readings[i].used = start_.data.readings[i].used && gyro[i] <= gyro_limit && accel[i] <= accel_limit;
}

}  // namespace fbvins
