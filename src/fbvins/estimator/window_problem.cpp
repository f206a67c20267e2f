// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_problem.hpp"

#include <algorithm>
#include <limits>

namespace fbvins {

Vec18 calibration_displacement(const Calibration& calibration, const Calibration& from) {
  Vec18 dx = Vec18::Zero();
  dx.segment<3>(0) = calibration.T_BC0.p - from.T_BC0.p;
  dx.segment<3>(3) = so3_log(from.T_BC0.q.conjugate() * calibration.T_BC0.q);
  dx.segment<3>(6) = calibration.T_BC1.p - from.T_BC1.p;
  dx.segment<3>(9) = so3_log(from.T_BC1.q.conjugate() * calibration.T_BC1.q);
  dx(kTimeOffsetIndex) = calibration.time_offset_s - from.time_offset_s;
  dx(kLineDelayIndex) = calibration.line_delay_s - from.line_delay_s;
  return dx;
}

bool Factor::touches(FrameId frame) const {
  const std::vector<Variable> all = variables();
  return std::any_of(all.begin(), all.end(), [&](const Variable& v) { return v.is_of_frame() && v.frame == frame; });
}

int WindowProblem::index_of(FrameId id) const {
  for (int i = 0; i < frame_count(); ++i)
    if (frames[i].id == id) return i;
  return -1;
}

Vec2 WindowProblem::residual(const WindowLandmark& landmark, const WindowObservation& observation) const {
  const CameraGeometry cameras(calibration);
  PairGeometry geometry;
  geometry.set(frames[landmark.host].state.T_FB, frames[observation.frame].state.T_FB);
  Vec3 p_C;
  Vec2 r;
  if (reproject(cameras, geometry, scaled_point_in_host(cameras, landmark), landmark.alpha_beta_rho.z(), observation, p_C, r))
    return r;
  return Vec2::Constant(std::numeric_limits<double>::infinity());
}

Vec3 WindowProblem::distance_to_prior(const WindowLandmark& l) const {
  return landmark_prior_residual(CameraGeometry(calibration), frames[l.host].state.T_FB, l, landmark_priors[l.prior]);
}

Eigen::VectorXd WindowProblem::prior_displacement() const {
  Eigen::VectorXd dx(prior.quadratic.size());
  if (prior.with_tilt) dx.head<kTiltSize>() = tilt.angle_rad;
  if (prior.with_calibration)
    dx.segment<kCalibrationSize>(prior.calibration_row()) = calibration_displacement(calibration, prior.calibration);
  int at = prior.frames_row();
  for (int frame : prior.frames) {
    dx.segment<15>(at) = frames[frame].state.boxminus(frames[frame].first_estimate);
    at += 15;
  }
  return dx;
}

}  // namespace fbvins
