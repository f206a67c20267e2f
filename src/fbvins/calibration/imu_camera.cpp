// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera.hpp"

#include <algorithm>

#include "fbvins/calibration/imu_camera_fit.hpp"
#include "fbvins/calibration/imu_camera_judge.hpp"
#include "fbvins/calibration/imu_camera_result.hpp"

namespace fbvins {
namespace {

constexpr double kFirstSigma_px = 1, kFirstHuber_px = 10;  // while start values are coarse
constexpr double kHuber_sigmas = 3, kNoBound = 1e9;
constexpr double kLooseGravity_mps2 = 10;
constexpr int kRounds = 3;
constexpr double kRough = 1.1;        // residuals of the readings in sigmas above which closer knots are tried
constexpr double kWorthwhile = 0.97;  // what closer knots must bring
constexpr double kClosestKnots_s = 0.004;

Error undetermined() {
  return {ErrorCode::invalid_argument,
          "the recording does not determine the calibration: turn about all three axes and move in all directions"};
}

}  // namespace

Result<CameraImuResult> calibrate_imu_camera(const ImuCameraInput& input, const ImuCameraOptions& options) {
  Result<CalibrationStart> start = collect_imu_camera(input, options);
  if (!start) return start.error();
  start->setup.free_board_scale = true;
  // Where the accelerometer's scale is asked for, gravity must be known.
  start->setup.gravity_sigma_mps2 = options.imu_axes ? options.gravity_sigma_mps2 : kLooseGravity_mps2;
  start->setup.corner_sigma_px = std::max(kFirstSigma_px, start->setup.corner_sigma_px);
  start->setup.corner_huber = kFirstHuber_px / start->setup.corner_sigma_px;
  ImuCameraFit fit(*std::move(start));
  if (!fit.solve() || !fit.judge()) return undetermined();
  CalibrationSetup setup = fit.problem().setup();
  setup.corner_huber = kHuber_sigmas;
  fit.change(setup);
  if (!fit.solve() || !fit.judge()) return undetermined();
  while (fit.worst_rms() > kRough && fit.problem().state().path.spacing_s() > 2 * kClosestKnots_s) {
    ImuCameraFit closer = fit;
    closer.halve_spacing();
    if (!closer.solve() || !closer.judge() || closer.worst_rms() > kWorthwhile * fit.worst_rms()) break;
    fit = std::move(closer);
  }
  // What stamps are off by is known better with each round.
  for (int round = 0; round < kRounds && fit.image_factor() > kImagesDoubtful; ++round)
    if (!fit.solve() || !fit.judge()) return undetermined();
  if (const auto wrong = check_agreement(fit)) return *wrong;
  const Magnitudes measured = magnitudes(fit);
  if (const auto wrong = check_magnitudes(measured, input.board, options.gravity_mps2)) return *wrong;

  setup = fit.problem().setup();
  setup.free_board_scale = false;
  setup.gravity_sigma_mps2 = options.gravity_sigma_mps2;
  setup.corner_huber = kNoBound;  // outliers are known by now
  fit.problem().fix_board_scale();
  fit.change(setup);
  if (!fit.solve() || !fit.judge() || !fit.solve() || !fit.judge()) return undetermined();
  fit.problem().linearise();
  CameraImuResult result = make_result(fit.problem(), fit.start(), input.variations);
  result.measured_gravity_mps2 = measured.gravity_mps2, result.measured_gravity_sigma_mps2 = measured.gravity_sigma;
  result.board_scale = measured.scale, result.board_scale_sigma = measured.scale_sigma;
  result.image_factor = fit.image_factor();
  result.gyro_rms_sigmas = fit.gyro_rms(), result.accel_rms_sigmas = fit.accel_rms();
  result.iterations = fit.iterations();
  result.remarks = remarks_on(result);
  if (const auto wrong = check_axes(result.axes)) return *wrong;
  if (const auto wrong = check_determined(result, fit.start().turning_radps)) return *wrong;
  return result;
}

}  // namespace fbvins
