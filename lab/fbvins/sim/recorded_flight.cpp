// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/recorded_flight.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fbvins {
namespace {

/// lambda of blend_second_differences for a crossover frequency.
double lambda_of(double crossover_hz, double dt_s) { return std::pow(2 * std::numbers::pi * crossover_hz * dt_s, -4.0); }

/// Pose at t between the two points around it: linear in position, one rotation.
Pose<W, B> between(const std::vector<TrajectoryPoint>& points, Time t) {
  const auto after = std::lower_bound(points.begin(), points.end(), t, [](const TrajectoryPoint& p, Time x) { return p.t < x; });
  if (after == points.begin()) return points.front().T_WB;
  if (after == points.end()) return points.back().T_WB;
  const TrajectoryPoint &a = *(after - 1), &b = *after;
  const double share = (t - a.t).seconds() / (b.t - a.t).seconds();
  return {a.T_WB.q.slerp(share, b.T_WB.q), Vec3(a.T_WB.p + share * (b.T_WB.p - a.T_WB.p))};
}

/// Poses at equal intervals, interpolated between `points`.
std::vector<Pose<W, B>> at_equal_times(const std::vector<TrajectoryPoint>& points, double dt_s) {
  std::vector<Pose<W, B>> poses;
  const double span = (points.back().t - points.front().t).seconds();
  for (int k = 0; k * dt_s <= span; ++k) poses.push_back(between(points, points.front().t + Duration::from_seconds(k * dt_s)));
  return poses;
}

std::vector<Vec3> positions_of(const std::vector<Pose<W, B>>& poses) {
  std::vector<Vec3> p;
  for (const auto& pose : poses) p.push_back(pose.p);
  return p;
}

/// Control points so that knot k is at time k * dt: two more in front, three behind.
SplineTrajectory spline_through(double dt_s, std::vector<Vec3> p, std::vector<Quat> q) {
  p.insert(p.begin(), 2, Vec3(p.front()));
  q.insert(q.begin(), 2, Quat(q.front()));
  p.insert(p.end(), 3, Vec3(p.back()));
  q.insert(q.end(), 3, Quat(q.back()));
  return {dt_s, std::move(p), std::move(q)};
}

Error too_short(double seconds) {
  return Error{ErrorCode::invalid_argument, fmt::format("the recorded flight covers {:.2f} s; at least 2 s are needed", seconds)};
}

/// The gyroscope's mean bias over the whole trajectory.
Vec3 mean_gyro_bias(const std::vector<Quat>& q, const std::vector<ImuSample>& imu, double dt) {
  const std::size_t step = static_cast<std::size_t>(std::lround(0.5 / dt));
  Vec3 sum = Vec3::Zero();
  double count = 0;
  for (std::size_t k = 0; k + step < q.size(); k += step, ++count) {
    Quat turned = Quat::Identity();
    for (std::size_t i = k; i < k + step; ++i) turned = turned * so3_exp(0.5 * dt * (imu[i].gyro_radps + imu[i + 1].gyro_radps));
    sum += so3_log(turned * (q[k].conjugate() * q[k + step]).conjugate()) / (static_cast<double>(step) * dt);
  }
  return count > 0 ? Vec3(sum / count) : Vec3::Zero();
}

}  // namespace

// The normal equations have five diagonals: banded Cholesky (L D L^T), once for all three axes.
std::vector<Vec3> blend_second_differences(const std::vector<Vec3>& y, const std::vector<Vec3>& c, double lambda) {
  const std::size_t n = y.size();
  if (n < 3) return y;
  std::vector<double> d0(n, 1.0), d1(n, 0.0), d2(n, 0.0);
  std::vector<Vec3> r = y;
  for (std::size_t k = 1; k + 1 < n; ++k) {
    d0[k - 1] += lambda, d0[k] += 4 * lambda, d0[k + 1] += lambda;
    d1[k - 1] -= 2 * lambda, d1[k] -= 2 * lambda, d2[k - 1] += lambda;
    r[k - 1] += lambda * c[k], r[k] -= 2 * lambda * c[k], r[k + 1] += lambda * c[k];
  }
  for (std::size_t k = 0; k < n; ++k) {  // d1, d2 become the factors below the diagonal
    const double l1 = d1[k] / d0[k], l2 = d2[k] / d0[k];
    if (k + 1 < n) {
      d0[k + 1] -= l1 * d1[k];
      d1[k + 1] -= l1 * d2[k];
      r[k + 1] -= l1 * r[k];
    }
    if (k + 2 < n) {
      d0[k + 2] -= l2 * d2[k];
      r[k + 2] -= l2 * r[k];
    }
    d1[k] = l1;
    d2[k] = l2;
  }
  for (std::size_t k = n; k-- > 0;) {
    r[k] /= d0[k];
    if (k + 1 < n) r[k] -= d1[k] * r[k + 1];
    if (k + 2 < n) r[k] -= d2[k] * r[k + 2];
  }
  return r;
}

Result<RecordedFlight> fly_again(const std::vector<TrajectoryPoint>& points, double crossover_hz) {
  const double span = points.size() < 2 ? 0 : (points.back().t - points.front().t).seconds();
  if (span < 2) return too_short(span);
  const double dt = std::clamp(span / static_cast<double>(points.size() - 1), 0.02, 0.1);
  const std::vector<Pose<W, B>> poses = at_equal_times(points, dt);
  const std::vector<Vec3> none(poses.size(), Vec3::Zero());
  const double lambda = lambda_of(3 * crossover_hz, dt);
  std::vector<Quat> q{poses.front().q};
  std::vector<Vec3> turned{Vec3::Zero()};  // sum of the rotation vectors of the steps, smoothed like a position
  for (std::size_t k = 1; k < poses.size(); ++k)
    turned.push_back(turned.back() + so3_log(poses[k - 1].q.conjugate() * poses[k].q));
  const std::vector<Vec3> smooth = blend_second_differences(turned, none, lambda);
  for (std::size_t k = 1; k < poses.size(); ++k) q.push_back((q.back() * so3_exp(smooth[k] - smooth[k - 1])).normalized());
  return RecordedFlight{spline_through(dt, blend_second_differences(positions_of(poses), none, lambda), q), points.front().t, {}};
}

Result<RecordedFlight> fly_again(const std::vector<TrajectoryPoint>& points, const std::vector<ImuSample>& all,
                                 double crossover_hz) {
  if (points.size() < 2) return too_short(0);
  RecordedFlight recorded;
  std::vector<ImuSample> imu;
  for (const ImuSample& s : all)
    if (s.t >= points.front().t && s.t <= points.back().t) imu.push_back(s);
  const double span = imu.size() < 2 ? 0 : (imu.back().t - imu.front().t).seconds();
  if (span < 2) return too_short(span);
  const double dt = span / static_cast<double>(imu.size() - 1);
  const std::size_t n = imu.size();
  const Vec3 none = Vec3::Zero();
  const double lambda = lambda_of(crossover_hz, dt);

  std::vector<Quat> truth;
  std::vector<Vec3> p;
  for (const ImuSample& s : imu) {
    const Pose<W, B> pose = between(points, s.t);
    truth.push_back(pose.q);
    p.push_back(pose.p);
  }
  // The gyroscope's integral, and its error in W: small and slow once the mean bias is removed.
  const Vec3 bias = mean_gyro_bias(truth, imu, dt);
  std::vector<Quat> q{truth.front()};
  for (std::size_t k = 1; k < n; ++k)
    q.push_back((q.back() * so3_exp(dt * (0.5 * (imu[k - 1].gyro_radps + imu[k].gyro_radps) - bias))).normalized());
  std::vector<Vec3> off;
  for (std::size_t k = 0; k < n; ++k) off.push_back(so3_log(truth[k] * q[k].conjugate()));
  off = blend_second_differences(off, std::vector<Vec3>(n, none), lambda);
  for (std::size_t k = 0; k < n; ++k) q[k] = (so3_exp(off[k]) * q[k]).normalized();

  std::vector<Vec3> steps;
  for (std::size_t k = 0; k < n; ++k) steps.push_back(dt * dt * (q[k] * imu[k].accel_mps2 - Vec3(0, 0, kSimGravity_mps2)));
  p = blend_second_differences(p, steps, lambda);

  recorded.flight = spline_through(dt, p, q);
  recorded.start = imu.front().t;
  for (std::size_t k = 0; k < n; ++k) {
    const MotionState m = recorded.flight.at(static_cast<double>(k) * dt);
    const std::size_t i = std::clamp<std::size_t>(k, 1, n - 2);
    TrueState state{imu[k].t, m.T_WB, m.v_WB, {}};
    state.bias.gyro_radps = bias - q[i].conjugate() * (off[i + 1] - off[i - 1]) / (2 * dt);
    state.bias.accel_mps2 = q[i].conjugate() * (steps[i] - (p[i - 1] - 2 * p[i] + p[i + 1])) / (dt * dt);
    recorded.imu.truth.push_back(state);
  }
  recorded.imu.samples = std::move(imu);
  return recorded;
}

}  // namespace fbvins
