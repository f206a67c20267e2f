// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_problem.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace fbvins {

Vec18 calibration_displacement(const Calibration& calibration, const Calibration& from) {
  Vec18 dx = Vec18::Zero();
  dx.segment<3>(0) = calibration.T_BC0().p - from.T_BC0().p;
  dx.segment<3>(3) = so3_log(from.T_BC0().q.conjugate() * calibration.T_BC0().q);
  dx.segment<3>(6) = calibration.T_BC1().p - from.T_BC1().p;
  dx.segment<3>(9) = so3_log(from.T_BC1().q.conjugate() * calibration.T_BC1().q);
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

void WindowProblem::residuals(const CameraGeometry& cameras, const WindowLandmark& l, std::vector<Vec2>& out) const {
  out.clear();
  const Vec3 x_h = scaled_point_in_host(cameras, l);
  PairGeometry pair;
  int of_pair = -1;
  for (int k = 0; k < l.observation_count; ++k) {
    const WindowObservation& o = observations[l.first_observation + k];
    if (std::exchange(of_pair, o.frame) != o.frame) pair.set(frames[l.host].state.T_FB, frames[o.frame].state.T_FB);
    Vec3 p_C;
    Vec2 r;
    const bool seen = reproject(cameras, pair, x_h, l.alpha_beta_rho.z(), o, p_C, r);
    out.push_back(seen ? r : Vec2::Constant(std::numeric_limits<double>::infinity()));
  }
}

Vec3 WindowProblem::distance_to_prior(const WindowLandmark& l) const {
  return landmark_prior_residual(CameraGeometry(calibration), frames[l.host].state.T_FB, l, landmark_priors[l.prior]);
}

const OwnVariable& WindowProblem::own_variable(int number) const {
  return *std::find_if(own.begin(), own.end(), [&](const OwnVariable& v) { return v.number == number; });
}

Eigen::VectorXd WindowProblem::displacement(const WindowPrior& from) const {
  Eigen::VectorXd dx = Eigen::VectorXd::Zero(from.quadratic.size());
  if (from.with_tilt) dx.head<kTiltSize>() = tilt.angle_rad;
  if (from.with_calibration)
    dx.segment<kCalibrationSize>(from.calibration_row()) = calibration_displacement(calibration, from.calibration);
  int at = from.own_row();
  for (const int number : from.own) {
    const Eigen::VectorXd& value = own_variable(number).value;
    dx.segment(at, value.size()) = value;
    at += static_cast<int>(value.size());
  }
  for (const int i : from.frames) {
    if (frames[i].in_prior) dx.segment<15>(at) = frames[i].state.boxminus(frames[i].first_estimate);
    at += 15;
  }
  return dx;
}

int WindowProblem::size_of(const Variable& v) const {
  switch (v.kind) {
    case Variable::Kind::pose: return 6;
    case Variable::Kind::motion: return 9;
    case Variable::Kind::tilt: return weights.estimate_tilt ? kTiltSize : 0;
    case Variable::Kind::calibration: return calibrating() ? kCalibrationSize : 0;
    case Variable::Kind::own: return static_cast<int>(own_variable(v.own).value.size());
  }
  return 0;
}

void WindowProblem::move(const Variable& v, const Eigen::Ref<const Eigen::VectorXd>& d) {
  switch (v.kind) {
    case Variable::Kind::pose: {
      Pose<G, B>& T = frames[index_of(v.frame)].state.T_FB;
      T = T.boxplus(d.segment<3>(nav::p), d.segment<3>(nav::theta));
      break;
    }
    case Variable::Kind::motion: {
      NavState<G>& state = frames[index_of(v.frame)].state;
      state.v_FB += d.segment<3>(0);
      state.bias.gyro_radps += d.segment<3>(3);
      state.bias.accel_mps2 += d.segment<3>(6);
      break;
    }
    case Variable::Kind::tilt: tilt.angle_rad += d; break;
    case Variable::Kind::calibration:
      calibration.cameras[0] = calibration.T_BC0().boxplus(d.segment<3>(0), d.segment<3>(3));
      calibration.cameras[1] = calibration.T_BC(1).boxplus(d.segment<3>(6), d.segment<3>(9));
      calibration.time_offset_s += d(kTimeOffsetIndex);
      calibration.line_delay_s += d(kLineDelayIndex);
      break;
    case Variable::Kind::own: const_cast<OwnVariable&>(own_variable(v.own)).value += d; break;
  }
}

}  // namespace fbvins
