// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "fbvins/calibration/imu_camera_gather.hpp"
#include "fbvins/calibration/imu_camera_result.hpp"
#include "fbvins/optim/levenberg_marquardt.hpp"

namespace fbvins {
namespace {

constexpr double kNoBound = 1e9, kFirstSigma_px = 1, kFirstHuber_px = 10;  // while start values are coarse
constexpr double kHuber_sigmas = 3;
constexpr double kCornerOutlier_sigmas = 4, kReadingOutlier_sigmas = 6;
constexpr int kMostIterations = 40, kRounds = 3;
constexpr double kTogether = 1.08;    // what all corners of an image are off by together, over their noise, that is more than chance
constexpr double kNoticed = 1.3, kDoubtful = 3, kContradiction = 10;  // and that is doubtful, or no calibration any more
constexpr double kFreedCamera_m = 0.02, kFreedCamera_rad = 0.05;
constexpr double kWorstScale = 0.015, kSure = 5, kUnsureScale = 0.02;  // of gravity and of the board's size: wrong, for certain
constexpr double kWorstAxes = 0.15;
constexpr double kBlurred = 1.6;      // residuals of an image over those of the median one
constexpr double kLooseGravity_mps2 = 10;
constexpr double kRough = 1.1;        // residuals of the readings in sigmas above which closer knots are tried
constexpr double kWorthwhile = 0.97;  // what closer knots must bring
constexpr double kClosestKnots_s = 0.004;
constexpr double kDegree = std::numbers::pi / 180;

Error error(std::string message) { return {ErrorCode::invalid_argument, std::move(message)}; }

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Fit, judgement of noise and outliers, fit: the parts of a calibration that repeat.
class Fitter {
 public:
  explicit Fitter(CalibrationStart start)
      : start_(std::move(start)), problem_(start_.data, start_.state, start_.setup) {}

  /// False where no step can be computed, or the steps do not come to an end.
  bool fit() {
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

  /// Corners, images and readings are judged by their residuals, and the noise by those that are left.
  bool judge() {
    judge_corners();
    judge_readings();
    problem_.linearise();
    if (covariance_ = problem_.calibration_covariance(); !covariance_) return false;
    sums_ = problem_.residual_sums();
    CalibrationSetup setup = problem_.setup();
    setup.corner_sigma_px *= sums_.corners.rms() * setup.image_factor;
    image_factor_ = sums_.images.rms() / sums_.corners.rms();
    setup.stamp_jitter_s = sums_.stamp_jitter_s;
    setup.image_factor = image_factor_ > kTogether ? image_factor_ : 1;
    gyro_rms_ = sums_.gyro.rms() * setup.gyro_sigma_radps / start_.nominal_gyro_sigma_radps;
    accel_rms_ = sums_.accel.rms() * setup.accel_sigma_mps2 / start_.nominal_accel_sigma_mps2;
    setup.gyro_sigma_radps = start_.nominal_gyro_sigma_radps * std::max(1.0, gyro_rms_);
    setup.accel_sigma_mps2 = start_.nominal_accel_sigma_mps2 * std::max(1.0, accel_rms_);
    problem_.change(setup);
    return true;
  }

  void change(const CalibrationSetup& setup) { problem_.change(setup); }

  /// The path again with knots half as far apart; the calibration stays.
  void halve_spacing() {
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

  double worst_rms() const { return std::max(gyro_rms_, accel_rms_); }
  double image_factor() const { return image_factor_; }
  double gyro_rms() const { return gyro_rms_; }
  double accel_rms() const { return accel_rms_; }
  int iterations() const { return iterations_; }
  ImuCameraProblem& problem() { return problem_; }
  const ImuCameraProblem& problem() const { return problem_; }
  const CalibrationStart& start() const { return start_; }
  const Eigen::MatrixXd& covariance() const { return *covariance_; }

 private:
  void judge_corners() {
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
    // By the middle corner, so that outliers do not make an image a bad one: the median of a Rayleigh distribution is 1.1774 sigmas.
    std::vector<double> all;
    for (auto& [key, image] : images) {
      image = {median(image) / 1.1774};
      all.push_back(image[0]);
    }
    const double typical = median(all);
    for (std::size_t v = 0; v < errors.size(); ++v) {
      CalibrationView& view = problem_.data().views[v];
      const double rms = images[{view.camera, view.t_s}][0];
      view.noise_factor = rms > kBlurred * typical ? rms / typical : 1;
      for (std::size_t i = 0; i < view.corners.size(); ++i)
        view.corners[i].used = errors[v][i] <= kCornerOutlier_sigmas * view.noise_factor * typical;
    }
  }

  void judge_readings() {
    std::vector<CalibrationReading>& readings = problem_.data().readings;
    std::vector<double> gyro, accel;
    for (const CalibrationReading& reading : readings) {
      const Vec6 r = problem_.reading_error(reading);
      gyro.push_back(r.head<3>().norm()), accel.push_back(r.tail<3>().norm());
    }
    // The median of the norm of three standard normal numbers is 1.538.
    const auto typical = [](const std::vector<double>& all) { return std::max(1.0, median(all) / 1.538); };
    const double gyro_limit = kReadingOutlier_sigmas * typical(gyro), accel_limit = kReadingOutlier_sigmas * typical(accel);
    for (std::size_t i = 0; i < readings.size(); ++i)
      readings[i].used = start_.data.readings[i].used && gyro[i] <= gyro_limit && accel[i] <= accel_limit;
  }

  CalibrationStart start_;
  ImuCameraProblem problem_;
  std::optional<Eigen::MatrixXd> covariance_;
  ResidualSums sums_;
  double gyro_rms_ = 0, accel_rms_ = 0, image_factor_ = 1;
  int iterations_ = 0;
};

/// Where images and readings contradict one another: because of the cameras' poses on one another, or for another reason.
std::optional<Error> check_agreement(const Fitter& fitter, std::size_t cameras) {
  if (fitter.image_factor() < kDoubtful) return std::nullopt;
  if (cameras > 1 && !fitter.problem().setup().T_CnC0.empty()) {
    Fitter freed = fitter;
    CalibrationSetup setup = freed.problem().setup();
    setup.camera_sigma_m = kFreedCamera_m, setup.camera_sigma_rad = kFreedCamera_rad;
    freed.change(setup);
    if (freed.fit() && freed.judge() && freed.image_factor() < 0.5 * fitter.image_factor())
      return error("the cameras' poses relative to one another, as given, contradict the images: calibrate the cameras with this board first");
  }
  if (fitter.image_factor() < kContradiction) return std::nullopt;
  return error(fmt::format("the images contradict the readings: the board is off by {:.0f} times the corners' noise; a lens, the stamps of the "
                           "images (or a rolling shutter) or the noise of the IMU is not as given", fitter.image_factor()));
}

struct Magnitudes {
  double gravity_mps2 = 0, gravity_sigma = 0, scale = 1, scale_sigma = 0;
};

/// Gravity as the accelerometer reads it, and the board's true size over the given one (C12).
Magnitudes magnitudes(Fitter& fitter) {
  const CalibrationLayout& at = fitter.problem().layout();
  const CalibrationState& state = fitter.problem().state();
  const auto P = fitter.covariance();
  const Vec3 up = state.gravity_T.normalized();
  const int g = at.gravity - at.begin, s = at.board_scale - at.begin;
  Magnitudes m;
  m.gravity_mps2 = state.gravity_T.norm();
  m.gravity_sigma = std::sqrt(up.dot(P.block<3, 3>(g, g) * up));
  const double given = fitter.problem().setup().gravity_mps2;
  m.scale = state.board_scale * given / m.gravity_mps2;
  Eigen::Vector4d J;  // by gravity, by the ratio of accelerometer to board
  J << -m.scale / m.gravity_mps2 * up, given / m.gravity_mps2;
  Eigen::Matrix4d Q;
  Q << P.block<3, 3>(g, g), P.block<3, 1>(g, s), P.block<1, 3>(s, g), P(s, s);
  m.scale_sigma = std::sqrt(J.dot(Q * J));
  return m;
}

std::optional<Error> check_magnitudes(const Magnitudes& m, const Board& board, const ImuCameraOptions& options) {
  const double given = options.gravity_mps2, off = std::abs(m.gravity_mps2 - given);
  if (off > kWorstScale * given && off > kSure * m.gravity_sigma)
    return error(fmt::format("gravity is measured as {:.3f} +- {:.3f} m/s^2: the accelerometer's scale is wrong{}", m.gravity_mps2,
                             m.gravity_sigma, off < kWorstAxes * given ? ", or has to be estimated" : ""));
  if (std::abs(m.scale - 1) > kWorstScale && std::abs(m.scale - 1) > kSure * m.scale_sigma)
    return error(fmt::format("the board is not as large as its file says: {:.1f} +- {:.1f} mm by the accelerometer instead of {:.1f} mm",
                             1e3 * m.scale * board.size_m, 1e3 * m.scale_sigma * board.size_m, 1e3 * board.size_m));
  return std::nullopt;
}

std::optional<Error> check_axes(const ImuAxes& axes) {
  const double off = std::max((axes.gyro - Mat3::Identity()).cwiseAbs().maxCoeff(), (axes.accel - Mat3::Identity()).cwiseAbs().maxCoeff());
  if (off < kWorstAxes) return std::nullopt;
  return error(fmt::format("the scale or an axis of the IMU would have to be wrong by {:.0f} %: its unit is wrong, or the recording does not "
                           "determine it", 100 * off));
}

std::optional<Error> check_determined(const CameraImuResult& result, const Vec3& turning_radps) {
  constexpr double kWorstTurn_rad = 0.2 * kDegree, kWorstLever_m = 5e-3, kWorstOffset_s = 1e-3;
  const auto worst = [](const Mat3& P) { return std::sqrt(P.diagonal().maxCoeff()); };
  for (std::size_t c = 0; c < result.cameras.size(); ++c) {
    const Mat6& P = result.cameras[c].covariance;
    if (const double turn = worst(P.bottomRightCorner<3, 3>()); !(turn < kWorstTurn_rad))
      return error(fmt::format("the rotation of camera {} on the IMU stays uncertain to {:.2f} degrees: turn about all three axes, for a minute",
                               c, turn / kDegree));
    if (const double lever = worst(P.topLeftCorner<3, 3>()); !(lever < kWorstLever_m))
      return error(fmt::format("the place of camera {} on the IMU stays uncertain to {:.1f} mm: turn faster and about all three axes (now by "
                               "{:.0f}, {:.0f} and {:.0f} degrees/s)", c, 1e3 * lever, turning_radps(0) / kDegree, turning_radps(1) / kDegree,
                               turning_radps(2) / kDegree));
  }
  if (!(result.time_offset_sigma_s < kWorstOffset_s))
    return error(fmt::format("the time offset stays uncertain to {:.1f} ms: turn faster", 1e3 * result.time_offset_sigma_s));
  return std::nullopt;
}

void remark(CameraImuResult& r) {
  const auto say = [&](std::string text) { r.remarks.push_back(std::move(text)); };
  if (r.board_scale_sigma > kUnsureScale)
    say(fmt::format("whether the board is as large as its file says is known to {:.0f} % only: move the rig more", 100 * r.board_scale_sigma));
  if (r.corner_sigma_px > 0.7)
    say(fmt::format("corners are seen to {:.2f} px only: blurred images, a wrong lens, or a rolling shutter", r.corner_sigma_px));
  if (r.image_factor > kNoticed)
    say(fmt::format("all corners of an image are off together by {:.1f} times what their noise explains (stamps, lens, vibration); the "
                    "uncertainties regard it", r.image_factor));
  if (r.stamp_jitter_s > 0) say(fmt::format("the stamps of the images jitter by {:.2f} ms; the uncertainties regard it", 1e3 * r.stamp_jitter_s));
  for (const auto& [rms, name] : {std::pair{r.gyro_rms_sigmas, "gyroscope"}, std::pair{r.accel_rms_sigmas, "accelerometer"}}) {
    if (rms > 1.5) say(fmt::format("the {} is {:.1f} times as noisy as given; the uncertainties regard it", name, rms));
    if (rms < 0.5) say(fmt::format("the noise given for the {} is {:.1f} times that of the readings", name, 1 / rms));
  }
}

Error undetermined() { return error("the recording does not determine the calibration: turn about all three axes and move in all directions"); }

}  // namespace

Result<CameraImuResult> calibrate_imu_camera(const ImuCameraInput& input, const ImuCameraOptions& options) {
  Result<CalibrationStart> start = gather_imu_camera(input, options);
  if (!start) return start.error();
  start->setup.free_board_scale = true;
  // Where the accelerometer's scale is asked for, gravity must be known.
  start->setup.gravity_sigma_mps2 = options.imu_axes ? options.gravity_sigma_mps2 : kLooseGravity_mps2;
  start->setup.corner_sigma_px = std::max(kFirstSigma_px, start->setup.corner_sigma_px);
  start->setup.corner_huber = kFirstHuber_px / start->setup.corner_sigma_px;
  Fitter fitter(*std::move(start));
  if (!fitter.fit() || !fitter.judge()) return undetermined();
  CalibrationSetup setup = fitter.problem().setup();
  setup.corner_huber = kHuber_sigmas;
  fitter.change(setup);
  if (!fitter.fit() || !fitter.judge()) return undetermined();
  while (options.knot_spacing_s <= 0 && fitter.worst_rms() > kRough && fitter.problem().state().path.spacing_s() > 2 * kClosestKnots_s) {
    Fitter closer = fitter;
    closer.halve_spacing();
    if (!closer.fit() || !closer.judge() || closer.worst_rms() > kWorthwhile * fitter.worst_rms()) break;
    fitter = std::move(closer);
  }
  // What stamps are off by is known better with each round.
  for (int round = 0; round < kRounds && fitter.image_factor() > kDoubtful; ++round)
    if (!fitter.fit() || !fitter.judge()) return undetermined();
  if (const auto wrong = check_agreement(fitter, input.cameras.size())) return *wrong;
  const Magnitudes measured = magnitudes(fitter);
  if (const auto wrong = check_magnitudes(measured, input.board, options)) return *wrong;

  setup = fitter.problem().setup();
  setup.free_board_scale = false;
  setup.gravity_sigma_mps2 = options.gravity_sigma_mps2;
  setup.corner_huber = kNoBound;  // outliers are known by now
  fitter.problem().fix_board_scale();
  fitter.change(setup);
  if (!fitter.fit() || !fitter.judge() || !fitter.fit() || !fitter.judge()) return undetermined();
  fitter.problem().linearise();
  CameraImuResult result = make_result(fitter.problem(), fitter.start());
  result.measured_gravity_mps2 = measured.gravity_mps2, result.measured_gravity_sigma_mps2 = measured.gravity_sigma;
  result.board_scale = measured.scale, result.board_scale_sigma = measured.scale_sigma;
  result.image_factor = fitter.image_factor();
  result.gyro_rms_sigmas = fitter.gyro_rms(), result.accel_rms_sigmas = fitter.accel_rms();
  result.iterations = fitter.iterations();
  remark(result);
  if (const auto wrong = check_axes(result.axes)) return *wrong;
  if (const auto wrong = check_determined(result, fitter.start().turning_radps)) return *wrong;
  return result;
}

}  // namespace fbvins
