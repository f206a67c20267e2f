// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera_result.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace fbvins {
namespace {

constexpr int kBiasesTold = 20;

/// Names, units and values in the order of the unknowns.
std::vector<CalibratedParameter> parameters_of(const CalibrationState& state, const CalibrationLayout& layout) {
  std::vector<CalibratedParameter> out(static_cast<std::size_t>(layout.end - layout.begin));
  const auto set = [&](int index, std::string name, const char* unit, double value) {
    out[static_cast<std::size_t>(index - layout.begin)] = {std::move(name), unit, value, 0};
  };
  const char* axis[3] = {"x", "y", "z"};
  for (std::size_t c = 0; c < state.T_BC.size(); ++c) {
    const Vec3 turn = so3_log(state.T_BC[c].q);
    for (int k = 0; k < 3; ++k) {
      set(layout.cameras[c] + k, fmt::format("p_BC{}_{}", c, axis[k]), "m", state.T_BC[c].p(k));
      set(layout.cameras[c] + 3 + k, fmt::format("theta_BC{}_{}", c, axis[k]), "rad", turn(k));
    }
  }
  set(layout.time_offset, "time_offset", "s", state.time_offset_s);
  for (int k = 0; k < 3; ++k) set(layout.gravity + k, fmt::format("gravity_T_{}", axis[k]), "m/s^2", state.gravity_T(k));
  if (layout.line_delay >= 0) set(layout.line_delay, "line_delay", "s", state.line_delay_s);
  for (std::size_t c = 1; layout.later >= 0 && c < state.later_s.size(); ++c)
    set(layout.later + static_cast<int>(c) - 1, fmt::format("later_{}", c), "s", state.later_s[c]);
  if (layout.axes >= 0)
    for (int row = 0, accel = layout.axes + 9; row < 3; ++row)
      for (int column = 0; column < 3; ++column) {
        set(layout.axes + 3 * row + column, fmt::format("gyro_{}{}", axis[row], axis[column]), "1", state.axes.gyro(row, column));
        if (column <= row) set(accel++, fmt::format("accel_{}{}", axis[row], axis[column]), "1", state.axes.accel(row, column));
      }
  return out;
}

void tell_cameras(const ImuCameraProblem& problem, const CalibrationStart& start, CameraImuResult& out) {
  std::vector<double> squares(out.cameras.size(), 0.0);
  for (const CalibrationView& view : problem.data().views) {
    const auto c = static_cast<std::size_t>(view.camera);
    CameraOnImu& camera = out.cameras[c];
    ViewFit fit{start.reference + Duration::from_seconds(view.t_s), view.camera, 0, view.noise_factor, {}, {}, {}};
    double square = 0;
    int used = 0;
    for (const WeightedCorner& corner : view.corners) {
      const auto e = problem.corner_error(view, corner);
      if (!corner.used || !e) {
        ++camera.outliers;
        continue;
      }
      ++used, square += e->squaredNorm();
      fit.corners.push_back(corner.index), fit.pixels.push_back(corner.pixel), fit.errors.push_back(*e);
    }
    ++camera.views, camera.corners += used, squares[c] += square;
    fit.rms_px = used > 0 ? std::sqrt(square / (2.0 * used)) : 0;
    out.view_fits.push_back(std::move(fit));
  }
  for (std::size_t c = 0; c < out.cameras.size(); ++c)
    out.cameras[c].rms_px = std::sqrt(squares[c] / std::max(1.0, 2.0 * out.cameras[c].corners));
}

/// Seen pixels, moved by what the fit predicts for the middle row's instant and for their own.
std::vector<BoardView> global_views(const ImuCameraProblem& problem, const CalibrationStart& start) {
  std::map<std::pair<double, int>, BoardView> images;  // groups of rows together
  for (const CalibrationView& view : problem.data().views) {
    BoardView& image = images[{view.t_s, view.camera}];
    image.t = start.reference + Duration::from_seconds(view.t_s), image.camera = view.camera;
    CalibrationView middle = view;
    middle.row = 0;
    for (WeightedCorner& corner : middle.corners) {
      const auto own = problem.corner_error(view, corner);
      corner.row = 0;
      const auto then = problem.corner_error(middle, corner);
      if (corner.used && own && then) image.corners.push_back({corner.index, corner.pixel + *then - *own});
    }
  }
  std::vector<BoardView> out;
  for (auto& [key, image] : images) {
    std::ranges::sort(image.corners, {}, &BoardCorner::index);
    if (!image.corners.empty()) out.push_back(std::move(image));
  }
  return out;
}

void tell_readings(const ImuCameraProblem& problem, const CalibrationStart& start, CameraImuResult& out) {
  for (const CalibrationReading& reading : problem.data().readings) {
    const Vec6 r = problem.reading_error(reading);
    ++(reading.used ? out.readings : out.readings_refused);
    out.reading_fits.push_back({start.reference + Duration::from_seconds(reading.t_s), r.head<3>(), r.tail<3>(), reading.used});
  }
}

void tell_biases(const ImuCameraProblem& problem, const CalibrationStart& start, CameraImuResult& out) {
  const CalibrationState& state = problem.state();
  const auto count = static_cast<int>(state.biases.size()) - 1;  // the last node lies behind the path
  const int step = std::max(1, count / kBiasesTold);
  for (int n = 0; n < count; n += step) {
    const double t_s = n * state.intervals_per_bias * state.path.spacing_s();
    out.biases.push_back(
        {start.reference + Duration::from_seconds(t_s), state.biases[static_cast<std::size_t>(n)], problem.bias_sigma(n)});
  }
}

}  // namespace

CameraImuResult make_result(ImuCameraProblem& problem, const CalibrationStart& start,
                            const std::vector<RigVariation>& variations) {
  const CalibrationState& state = problem.state();
  const CalibrationLayout& at = problem.layout();
  CameraImuResult out;
  const auto P = problem.calibration_covariance();
  out.covariance = P ? *P : Eigen::MatrixXd::Constant(at.end - at.begin, at.end - at.begin, std::nan(""));
  tell_biases(problem, start, out);
  for (const RigVariation& variation : variations) {
    const Eigen::VectorXd moved = problem.response(variation);
    out.covariance += moved * moved.transpose();
  }
  out.parameters = parameters_of(state, at);
  for (std::size_t i = 0; i < out.parameters.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    out.parameters[i].sigma = std::sqrt(out.covariance(k, k));
  }
  const auto sigma = [&](int index) { return out.parameters[static_cast<std::size_t>(index - at.begin)].sigma; };
  for (std::size_t c = 0; c < state.T_BC.size(); ++c) {
    const int i = at.cameras[c] - at.begin;
    out.cameras.push_back({state.T_BC[c], out.covariance.block<6, 6>(i, i), state.later_s[c]});
    if (at.later >= 0 && c > 0) out.cameras[c].later_sigma_s = sigma(at.later + static_cast<int>(c) - 1);
  }
  out.time_offset_s = state.time_offset_s, out.time_offset_sigma_s = sigma(at.time_offset);
  out.gravity_T = state.gravity_T;
  out.gravity_covariance = out.covariance.block<3, 3>(at.gravity - at.begin, at.gravity - at.begin);
  if (at.line_delay >= 0) out.line_delay_s = state.line_delay_s, out.line_delay_sigma_s = sigma(at.line_delay);
  out.axes = state.axes;
  out.axes_sigma = {Mat3::Zero(), Mat3::Zero()};
  if (at.axes >= 0)
    for (int row = 0, accel = at.axes + 9; row < 3; ++row)
      for (int column = 0; column < 3; ++column) {
        out.axes_sigma.gyro(row, column) = sigma(at.axes + 3 * row + column);
        if (column <= row) out.axes_sigma.accel(row, column) = sigma(accel++);
      }
  out.corner_sigma_px = problem.setup().corner_sigma_px;
  out.stamp_jitter_s = problem.setup().stamp_jitter_s;
  out.knot_spacing_s = state.path.spacing_s();
  out.duration_s = state.path.duration_s();
  tell_cameras(problem, start, out);
  if (at.line_delay >= 0) out.global_views = global_views(problem, start);
  tell_readings(problem, start, out);
  return out;
}

}  // namespace fbvins
