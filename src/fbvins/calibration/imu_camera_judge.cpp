// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera_judge.hpp"
#include "fbvins/calibration/refused.hpp"
#include "fbvins/core/angle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

// What the corners of an image are off by together, over their noise: worth a remark, doubtful, no calibration any more.
constexpr double kNoticed = 1.3, kContradiction = 10;
constexpr double kFreedCamera_m = 0.02, kFreedCamera_rad = 0.05;
constexpr double kWorstScale = 0.015, kSure = 5, kUnsureScale = 0.02;  // of gravity and of the board's size: wrong, for certain
constexpr double kWorstAxes = 0.15;

}  // namespace

Magnitudes magnitudes(const ImuCameraFit& fit) {
  const CalibrationLayout& at = fit.problem().layout();
  const CalibrationState& state = fit.problem().state();
  const auto P = fit.covariance();
  const Vec3 up = state.gravity_T.normalized();
  const int g = at.gravity - at.begin, s = at.board_scale - at.begin;
  Magnitudes m;
  m.gravity_mps2 = state.gravity_T.norm();
  m.gravity_sigma = std::sqrt(up.dot(P.block<3, 3>(g, g) * up));
  const double given = fit.problem().setup().gravity_mps2;
  m.scale = state.board_scale * given / m.gravity_mps2;
  Eigen::Vector4d J;  // by gravity, by the ratio of accelerometer to board
  J << -m.scale / m.gravity_mps2 * up, given / m.gravity_mps2;
  Eigen::Matrix4d Q;
  Q << P.block<3, 3>(g, g), P.block<3, 1>(g, s), P.block<1, 3>(s, g), P(s, s);
  m.scale_sigma = std::sqrt(J.dot(Q * J));
  return m;
}

/// Where images and readings contradict one another: because of the cameras' poses on one another, or for another reason.
std::optional<Error> check_agreement(const ImuCameraFit& fit) {
  if (fit.image_factor() < kImagesDoubtful) return std::nullopt;
  if (fit.problem().data().cameras.size() > 1 && !fit.problem().setup().T_CnC0.empty()) {
    ImuCameraFit freed = fit;
    CalibrationSetup setup = freed.problem().setup();
    setup.camera_sigma_m = kFreedCamera_m, setup.camera_sigma_rad = kFreedCamera_rad;
    freed.change(setup);
    if (freed.solve() && freed.judge() && freed.image_factor() < 0.5 * fit.image_factor())
      return refused(
          "the cameras' poses relative to one another, as given, contradict the images: calibrate the cameras with this board first");
  }
  if (fit.image_factor() < kContradiction) return std::nullopt;
  return refused(fmt::format(
      "the images contradict the readings: the board is off by {:.0f} times the corners' noise; a lens, the stamps of the "
      "images (or a rolling shutter) or the noise of the IMU is not as given",
      fit.image_factor()));
}

std::optional<Error> check_magnitudes(const Magnitudes& m, const Board& board, double given) {
  const double off = std::abs(m.gravity_mps2 - given);
  if (off > kWorstScale * given && off > kSure * m.gravity_sigma)
    return refused(fmt::format("gravity is measured as {:.3f} +- {:.3f} m/s^2: the accelerometer's scale is wrong{}",
                               m.gravity_mps2, m.gravity_sigma, off < kWorstAxes * given ? ", or has to be estimated" : ""));
  if (m.scale < 0 && -m.scale > kSure * m.scale_sigma)
    return refused(
        "the images move against the accelerometer: all of its signs are wrong, or the images, or the board's print, are mirrored");
  if (std::abs(m.scale - 1) > kWorstScale && std::abs(m.scale - 1) > kSure * m.scale_sigma)
    return refused(
        fmt::format("the board is not as large as its file says: {:.1f} +- {:.1f} mm by the accelerometer instead of {:.1f} mm",
                    1e3 * m.scale * board.size_m, 1e3 * m.scale_sigma * board.size_m, 1e3 * board.size_m));
  return std::nullopt;
}

std::optional<Error> check_axes(const ImuTriads& axes) {
  const double off =
      std::max((axes.gyro - Mat3::Identity()).cwiseAbs().maxCoeff(), (axes.accel - Mat3::Identity()).cwiseAbs().maxCoeff());
  if (off < kWorstAxes) return std::nullopt;
  return refused(fmt::format(
      "the scale or an axis of the IMU would have to be wrong by {:.0f} %: its unit is wrong, or the recording does not "
      "determine it",
      100 * off));
}

std::optional<Error> check_determined(const CameraImuResult& result, const Vec3& turning_radps) {
  constexpr double kWorstTurn_rad = 0.2 * kDegree, kWorstLever_m = 5e-3, kWorstOffset_s = 1e-3;
  const auto worst = [](const Mat3& P) { return std::sqrt(P.diagonal().maxCoeff()); };
  for (std::size_t c = 0; c < result.cameras.size(); ++c) {
    const Mat6& P = result.cameras[c].covariance;
    if (const double turn = worst(P.bottomRightCorner<3, 3>()); !(turn < kWorstTurn_rad))
      return refused(fmt::format(
          "the rotation of camera {} on the IMU stays uncertain to {:.2f} degrees: turn about all three axes, for a minute", c,
          turn / kDegree));
    if (const double lever = worst(P.topLeftCorner<3, 3>()); !(lever < kWorstLever_m))
      return refused(fmt::format(
          "the place of camera {} on the IMU stays uncertain to {:.1f} mm: turn faster and about all three axes (now by "
          "{:.0f}, {:.0f} and {:.0f} degrees/s)",
          c, 1e3 * lever, turning_radps(0) / kDegree, turning_radps(1) / kDegree, turning_radps(2) / kDegree));
  }
  if (!(result.time_offset_sigma_s < kWorstOffset_s))
    return refused(fmt::format("the time offset stays uncertain to {:.1f} ms: turn faster", 1e3 * result.time_offset_sigma_s));
  for (std::size_t c = 1; c < result.cameras.size(); ++c)
    if (const double sigma_s = result.cameras[c].later_sigma_s; !(sigma_s < kWorstOffset_s))
      return refused(fmt::format("the time offset of camera {} stays uncertain to {:.1f} ms: turn faster", c, 1e3 * sigma_s));
  return std::nullopt;
}

std::vector<std::string> remarks_on(const CameraImuResult& r) {
  std::vector<std::string> remarks;
  const auto say = [&](std::string text) { remarks.push_back(std::move(text)); };
  if (r.board_scale_sigma > kUnsureScale)
    say(fmt::format("whether the board is as large as its file says is known to {:.0f} % only: move the rig more",
                    100 * r.board_scale_sigma));
  if (r.corner_sigma_px > 0.7)
    say(fmt::format("corners are seen to {:.2f} px only: blurred images, a wrong lens, or a rolling shutter", r.corner_sigma_px));
  if (r.image_factor > kNoticed)
    say(fmt::format(
        "all corners of an image are off together by {:.1f} times what their noise explains (stamps, lens, vibration); the "
        "uncertainties regard it",
        r.image_factor));
  if (r.stamp_jitter_s > 0)
    say(fmt::format("the stamps of the images jitter by {:.2f} ms; the uncertainties regard it", 1e3 * r.stamp_jitter_s));
  for (const auto& [rms, name] : {std::pair{r.gyro_rms_sigmas, "gyroscope"}, std::pair{r.accel_rms_sigmas, "accelerometer"}}) {
    if (rms > 1.5) say(fmt::format("the {} is {:.1f} times as noisy as given; the uncertainties regard it", name, rms));
    if (rms < 0.5) say(fmt::format("the noise given for the {} is {:.1f} times that of the readings", name, 1 / rms));
  }
  return remarks;
}

}  // namespace fbvins
