// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/velocity_factor.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/hypotenuse.hpp"
#include "fbvins/estimator/window_equations.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

/// What handing a reading on to the next frame adds.
constexpr double kHandedOn_mps = 0.02;
/// Readings that slip differ by so many standard deviations.
constexpr double kSlip_sigma = 4;
/// And by such a share of the speed, with one camera, whose scale is not known well.
constexpr double kSlipOfOneCamera = 0.25;

/// Where the sensor sits, in its own axes.
Vec3 predicted_S(const VelocityAtFrame& m, const NavState<G>& state) {
  const Vec3 rate_B = m.gyro_radps - state.bias.gyro_radps;
  return m.reading.q_BS.conjugate() * (state.v_B() + rate_B.cross(m.reading.p_B));
}

/// One over the standard deviations; 0 for axes along which it measures nothing.
Vec3 weights(const VelocitySample& reading) {
  return reading.sigma_mps.unaryExpr([](double sigma) { return sigma < kUnmeasured_mps ? 1 / sigma : 0; });
}

Vec3 residual(const VelocityAtFrame& m, const NavState<G>& state) {
  return weights(m.reading).cwiseProduct(predicted_S(m, state) - m.reading.v_mps);
}

/// The state and the gyroscope's reading some time before the frame.
struct Before {
  NavState<G> state;
  Vec3 gyro_radps = Vec3::Zero();
};
Before before(const NewFrame& f, Time t) {
  Before out{f.frame.state};
  const std::vector<ImuSample>& imu = f.tracked.imu.samples;
  if (imu.empty()) return out;
  const Vec3 gravity_G = f.window.tilt().gravity_G(kGravity_mps2);
  out.gyro_radps = imu.back().gyro_radps;
  Time at = f.frame.t;
  for (std::size_t k = imu.size() - 1; k > 0 && at > t; --k) {
    const Time to = std::max(t, std::min(at, imu[k - 1].t));
    const double dt_s = (at - to).seconds();
    NavState<G>& s = out.state;
    s.v_FB -= dt_s * (s.T_FB.q * (imu[k].accel_mps2 - s.bias.accel_mps2) + gravity_G);
    s.T_FB.q = s.T_FB.q * so3_exp(-dt_s * (imu[k].gyro_radps - s.bias.gyro_radps));
    out.gyro_radps = imu[k - 1].gyro_radps;
    at = to;
  }
  return out;
}

/// The reading with the change since then.
VelocityAtFrame at_frame(const NewFrame& f, const VelocitySample& reading) {
  VelocityAtFrame out{reading};
  if (!f.tracked.imu.samples.empty()) out.gyro_radps = f.tracked.imu.samples.back().gyro_radps;
  const Before then = before(f, reading.t);
  out.reading.v_mps += predicted_S(out, f.frame.state) - predicted_S({reading, then.gyro_radps}, then.state);
  out.reading.t = f.frame.t;
  return out;
}

bool same_sensor(const VelocitySample& a, const VelocitySample& b) {
  return a.p_B == b.p_B && a.q_BS.coeffs() == b.q_BS.coeffs();
}

/// Of each sensor the mean. Its readings' errors have much in common: the mean is no better than one of them.
std::vector<VelocityAtFrame> readings_at(const NewFrame& f) {
  std::vector<VelocityAtFrame> out;
  std::vector<int> counts;
  for (const VelocitySample& reading : readings_of<VelocitySample>(f.tracked.aiding)) {
    const VelocityAtFrame one = at_frame(f, reading);
    const auto same = std::ranges::find_if(out, [&](const VelocityAtFrame& m) { return same_sensor(m.reading, reading); });
    if (same == out.end()) {
      out.push_back(one), counts.push_back(1);
      continue;
    }
    const int n = ++counts[static_cast<std::size_t>(same - out.begin())];
    same->reading.v_mps += (one.reading.v_mps - same->reading.v_mps) / n;
    same->reading.sigma_mps = same->reading.sigma_mps.cwiseMax(one.reading.sigma_mps);
  }
  return out;
}

}  // namespace

double VelocityFactor::cost(const WindowProblem& w) const {
  return huber(residual(measured_, w.frame(frame_).state).squaredNorm(), w.weights.huber_sigma).cost;
}

double VelocityFactor::linearise(const WindowProblem& w, NormalEquations& out) const {
  const Vec3 r = residual(measured_, w.frame(frame_).state);
  const NavState<G> state = w.linearisation_point(w.index_of(frame_));
  const Mat3 to_S = weights(measured_.reading).asDiagonal() * measured_.reading.q_BS.conjugate().toRotationMatrix();
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, 15);
  J.block<3, 3>(0, nav::theta) = to_S * hat(state.v_B());
  J.block<3, 3>(0, nav::v) = to_S * state.T_FB.R().transpose();
  J.block<3, 3>(0, nav::bg) = to_S * hat(measured_.reading.p_B);
  const RobustValue robust = huber(r.squaredNorm(), w.weights.huber_sigma);
  add_residual(w, variables(), J, r, robust.weight, out);
  return robust.cost;
}

std::shared_ptr<const Factor> VelocityFactor::without(const DroppedFrame& d) const {
  VelocityAtFrame next = measured_;
  next.reading.v_mps += next.reading.q_BS.conjugate() * (d.v_successor_B - d.v_dropped_B);
  next.reading.sigma_mps = next.reading.sigma_mps.unaryExpr([](double sigma) { return hypotenuse(sigma, kHandedOn_mps); });
  return std::make_shared<const VelocityFactor>(d.successor, next);
}

bool VelocityMaker::slips(const VelocityAtFrame& m, const NavState<G>& predicted) const {
  const Vec3 off = predicted_S(m, predicted) - m.reading.v_mps;
  const double least = std::max(slip_mps_, images_show_scale_ ? 0 : kSlipOfOneCamera * predicted.v_FB.norm());
  for (int k = 0; k < 3; ++k)
    if (m.reading.sigma_mps(k) < kUnmeasured_mps && std::abs(off(k)) > std::max(least, kSlip_sigma * m.reading.sigma_mps(k)))
      return true;
  return false;
}

std::vector<std::shared_ptr<const Factor>> VelocityMaker::make(const NewFrame& f) {
  std::vector<std::shared_ptr<const Factor>> out;
  const std::vector<VelocityAtFrame> all = readings_at(f);
  for (const VelocityAtFrame& measured : all)
    if (!slips(measured, f.frame.state)) out.push_back(std::make_shared<const VelocityFactor>(f.frame.id, measured));
  if (!all.empty()) doubt_.count(f.frame.t, out.size() == all.size());
  return out;
}

}  // namespace fbvins
