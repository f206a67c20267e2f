// SPDX-License-Identifier: Apache-2.0
// How accurately cameras are found on an IMU: simulated hand-held recordings of a board, corners with noise, against the truth.
//
//   imu_camera [--recordings 20] [--duration 72] [--cameras 2] [--first-seed 100] [--line-delay 0] [--axes] [--trouble]
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "fbvins/core/angle.hpp"
#include "tests/support/imu_camera_scene.hpp"

using namespace fbvins;

namespace {

/// Errors and normalised squared errors of one block of parameters over all recordings.
struct Block {
  const char* name;
  const char* unit;
  double per_unit;
  double bar;  ///< largest error that the project wants, in the unit; 0: none
  std::vector<double> errors = {}, sigmas = {}, nees = {};

  void add(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
    errors.push_back(error.norm() * per_unit);
    sigmas.push_back(std::sqrt(covariance.trace()) * per_unit);
    nees.push_back(test::squared_sigmas(error, covariance) / static_cast<double>(error.size()));
  }
  void print() const {
    if (errors.empty()) return;
    double mean = 0, square = 0, sigma = 0;
    for (std::size_t i = 0; i < errors.size(); ++i)
      mean += nees[i] / static_cast<double>(errors.size()), square += errors[i] * errors[i] / static_cast<double>(errors.size()),
          sigma += sigmas[i] / static_cast<double>(errors.size());
    fmt::print("| {} [{}] | {:.4f} | {:.4f} | {:.4f} | {} | {:.2f} | {:.2f} |\n", name, unit, std::sqrt(square),
               *std::max_element(errors.begin(), errors.end()), sigma, bar > 0 ? fmt::format("{:g}", bar) : "", mean,
               std::sqrt(*std::max_element(nees.begin(), nees.end())));
  }
};

Vec3 turn_error(const Quat& truth, const Quat& estimate) { return so3_log(truth.conjugate() * estimate); }

/// Across the direction of gravity: its two components.
void add_gravity(Block& block, const CameraImuResult& found, const Vec3& truth) {
  const Vec3 up = truth.normalized(), x = up.unitOrthogonal(), y = up.cross(x);
  Eigen::Matrix<double, 2, 3> J;
  J << x.transpose(), y.transpose();
  J /= truth.norm();
  block.add(J * (found.gravity_T - truth), J * found.gravity_covariance * J.transpose());
}

struct Setup {
  int recordings = 20, first_seed = 100;
  test::HandHeldOptions scene = {};
  ImuCameraOptions options = {};
  bool trouble = false;

  void add_to(CLI::App& app) {
    scene.duration_s = 72;
    app.add_option("--recordings", recordings);
    app.add_option("--first-seed", first_seed);
    app.add_option("--duration", scene.duration_s);
    app.add_option("--cameras", scene.cameras);
    app.add_option("--line-delay", scene.line_delay_s);
    app.add_flag("--axes", options.imu_axes);
    app.add_flag("--trouble", trouble, "outliers, blur, dropped readings and spikes, the board out of view");
  }
  /// What follows from the arguments.
  void complete() {
    options.line_delay = scene.line_delay_s != 0;
    if (options.imu_axes) {
      scene.axes.gyro << 1.01, 0.004, -0.006, 0.003, 0.995, 0.002, -0.001, 0.005, 1.003;
      scene.axes.accel << 1.006, 0, 0, 0.004, 0.992, 0, -0.003, 0.002, 1.01;
    }
    if (trouble)
      scene.outlier_share = 0.01, scene.blur_share = 0.1, scene.dropped_share = 0.02, scene.spike_share = 0.001,
      scene.hidden_from_s = 10, scene.hidden_to_s = 13;
  }
};

/// What is found beside the truth, over all recordings.
class Comparison {
 public:
  explicit Comparison(const Setup& setup) : setup_(setup) {}

  void add(int seed, const CameraImuResult& found, const test::HandHeldTruth& truth, double took_s);
  void print(int refused, double mean_s, double worst_s) const;

 private:
  void add_axes(const CameraImuResult& found, const test::HandHeldTruth& truth);

  const Setup& setup_;
  Block turn_{"rotation", "deg", 1 / kDegree, 0.01}, place_{"translation", "mm", 1e3, 0.5},
      offset_{"time offset", "ms", 1e3, 0.05}, gravity_{"direction of gravity", "deg", 1 / kDegree, 0},
      delay_{"line delay", "us", 1e6, 0}, gyro_axes_{"gyroscope's axes", "1e-3", 1e3, 0},
      accel_axes_{"accelerometer's axes", "1e-3", 1e3, 0}, gyro_bias_{"gyroscope bias", "mrad/s", 1e3, 0},
      accel_bias_{"accelerometer bias", "mm/s2", 1e3, 0};
  double gyro_rms_ = 0, accel_rms_ = 0, corner_ = 0, scale_nees_ = 0;
};

Eigen::VectorXd one(double x) { return Eigen::VectorXd::Constant(1, x); }
Eigen::MatrixXd square(double x) { return Eigen::MatrixXd::Constant(1, 1, x * x); }

void Comparison::add_axes(const CameraImuResult& found, const test::HandHeldTruth& truth) {
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) {
      gyro_axes_.add(one(found.axes.gyro(row, column) - truth.axes.gyro(row, column)),
                     square(found.axes_sigma.gyro(row, column)));
      if (column <= row)
        accel_axes_.add(one(found.axes.accel(row, column) - truth.axes.accel(row, column)),
                        square(found.axes_sigma.accel(row, column)));
    }
}

void Comparison::add(int seed, const CameraImuResult& found, const test::HandHeldTruth& truth, double took_s) {
  const CameraOnImu& left = found.cameras[0];
  turn_.add(turn_error(truth.T_BC[0].q, left.T_BC.q), left.covariance.bottomRightCorner<3, 3>());
  place_.add(left.T_BC.p - truth.T_BC[0].p, left.covariance.topLeftCorner<3, 3>());
  offset_.add(one(found.time_offset_s - truth.time_offset_s), square(found.time_offset_sigma_s));
  add_gravity(gravity_, found, truth.gravity_T);
  if (setup_.options.line_delay) delay_.add(one(found.line_delay_s - truth.line_delay_s), square(found.line_delay_sigma_s));
  if (setup_.options.imu_axes) add_axes(found, truth);
  const BiasAt* bias = &found.biases[found.biases.size() / 2];
  const ImuBias& true_bias = truth.bias_at(bias->t);
  gyro_bias_.add(bias->bias.gyro_radps - true_bias.gyro_radps, Mat3(bias->sigma.gyro_radps.cwiseAbs2().asDiagonal()));
  accel_bias_.add(bias->bias.accel_mps2 - true_bias.accel_mps2, Mat3(bias->sigma.accel_mps2.cwiseAbs2().asDiagonal()));
  gyro_rms_ += found.gyro_rms_sigmas, accel_rms_ += found.accel_rms_sigmas, corner_ += found.corner_sigma_px;
  scale_nees_ += std::pow((found.board_scale - 1) / found.board_scale_sigma, 2);
  fmt::print(
      "{}: {:.3f} mm {:.5f} deg {:.4f} ms, scale {:.5f} +- {:.5f}, gravity {:.4f} +- {:.4f}, knots {:g} s, gyro {:.3f} accel {:.3f}, {} iterations, {:.1f} s\n",
      seed, place_.errors.back(), turn_.errors.back(), offset_.errors.back(), found.board_scale, found.board_scale_sigma,
      found.measured_gravity_mps2, found.measured_gravity_sigma_mps2, found.knot_spacing_s, found.gyro_rms_sigmas,
      found.accel_rms_sigmas, found.iterations, took_s);
}

void Comparison::print(int refused, double mean_s, double worst_s) const {
  const int done = std::max(1, setup_.recordings - refused);
  fmt::print("\n| | RMS | worst | sigma | wanted | NEES | worst sigmas |\n|---|---|---|---|---|---|---|\n");
  for (const Block* b : {&turn_, &place_, &offset_, &gravity_, &delay_, &gyro_axes_, &accel_axes_, &gyro_bias_, &accel_bias_})
    b->print();
  fmt::print(
      "\n{} recordings of {:g} s, {} refused; {:.1f} s each, {:.1f} at most; corners {:.4f} px, gyroscope {:.3f}, accelerometer {:.3f} "
      "sigmas; NEES of the board's scale {:.2f}\n",
      setup_.recordings, setup_.scene.duration_s, refused, mean_s, worst_s, corner_ / done, gyro_rms_ / done, accel_rms_ / done,
      scale_nees_ / done);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"accuracy of the camera-IMU calibration on simulated recordings"};
  Setup setup;
  setup.add_to(app);
  CLI11_PARSE(app, argc, argv);
  setup.complete();
  Comparison comparison(setup);
  double worst_s = 0, mean_s = 0;
  int refused = 0;
  for (int seed = setup.first_seed; seed < setup.first_seed + setup.recordings; ++seed) {
    const test::HandHeldRecording r = test::hand_held(setup.scene, static_cast<std::uint64_t>(seed));
    const auto began = std::chrono::steady_clock::now();
    const Result<CameraImuResult> found = calibrate_imu_camera(r.input, setup.options);
    const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    worst_s = std::max(worst_s, took_s), mean_s += took_s / setup.recordings;
    if (found) comparison.add(seed, *found, r.truth, took_s);
    else ++refused, fmt::print("{}: {}\n", seed, found.error().message);
    std::fflush(stdout);
  }
  comparison.print(refused, mean_s, worst_s);
  return 0;
}
