// SPDX-License-Identifier: Apache-2.0
// For tests: a flight known exactly, an estimate of it that errs as odometry does, and what motion capture would have recorded.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/mocap/hand_eye.hpp"

namespace fbvins::test {

inline Vec3 normal3(Rng& rng) {
  const double x = rng.normal(), y = rng.normal(), z = rng.normal();
  return {x, y, z};
}
inline Vec3 direction(Rng& rng) { return normal3(rng).normalized(); }

/// A quadrotor that wanders through a room: rests, flies, rests. B sits on it as `q_FB` says.
class ExactFlight {
 public:
  /// Lively: it is rocked by hand or by the pilot, about as fast as EuRoC's Vicon-room flights; else it turns and tilts a third
  /// as fast.
  ExactFlight(std::uint64_t seed, double duration_s, bool lively = true) : duration_s_(duration_s) {
    Rng rng(seed, 11);
    q_FB_ = so3_exp(rng.uniform(0.5, 3) * direction(rng));
    const double sizes[4] = {1.0, 0.8, 0.3, 0.7};
    for (int axis = 0; axis < 4; ++axis)
      for (int wave = 0; wave < 3; ++wave)
        waves_[axis][wave] = {sizes[axis] * rng.uniform(0.3, 0.8), 2 * std::numbers::pi / rng.uniform(3.0, 12.0),
                              rng.uniform(0, 6.28)};
    for (int axis = 0; lively && axis < 3; ++axis)
      waves_[axis][2] = {rng.uniform(0.06, 0.1), 2 * std::numbers::pi / rng.uniform(1.3, 2.2), rng.uniform(0, 6.28)};
  }

  double duration_s() const { return duration_s_; }
  Pose<W, B> at(double t) const {
    constexpr double h = 1e-3;
    const Vec3 p = position(t);
    const Vec3 thrust = (position(t + h) - 2 * p + position(t - h)) / (h * h) + Vec3(0, 0, 9.81);
    const Quat q_tilt = so3_between(Vec3::UnitZ(), thrust);
    const Quat q_WF = q_tilt * Quat(Eigen::AngleAxisd(activity(t) * sum(3, t), Vec3::UnitZ()));
    return {(q_WF * q_FB_).normalized(), p};
  }
  bool still_yaw = false;  ///< never turns about the vertical
  double size = 1;         ///< of the path

 private:
  struct Wave {
    double amplitude, radps, phase;
  };
  double sum(int axis, double t) const {
    if (axis == 3 && still_yaw) return 0;
    double s = 0;
    for (const Wave& wave : waves_[axis]) s += wave.amplitude * (std::sin(wave.radps * t + wave.phase) - std::sin(wave.phase));
    return s;
  }
  /// 0 at rest, 1 in flight, with smooth second derivatives.
  double activity(double t) const {
    const double u = std::clamp(std::min(t - 2, duration_s_ - 2 - t) / 4, 0.0, 1.0);
    return u * u * u * (10 + u * (-15 + 6 * u));
  }
  Vec3 position(double t) const { return size * activity(t) * (Vec3(sum(0, t), sum(1, t), sum(2, t)) + Vec3(0, 0, 1)); }

  double duration_s_;
  Quat q_FB_;
  Wave waves_[4][3];
};

/// Sizes of an odometry's errors; the defaults are those of full flights on rendered and real images (docs/benchmarks.md).
struct OdometryErrors {
  double position_walk_m_rts = 0.002, heading_walk_rad_rts = 4e-4;
  double tilt_rad = 1e-3, tilt_memory_s = 5;
  double scale = 0.002;
  double white_m = 0.0005, white_rad = 4e-4;
};

/// 20 poses a second, the first at `start`.
inline Trajectory<W> estimate_of(const ExactFlight& flight, Time start, const OdometryErrors& errors, std::uint64_t seed) {
  Rng rng(seed, 12);
  constexpr double dt = 0.05;
  const double scale = 1 + errors.scale * rng.normal(), left = std::exp(-dt / errors.tilt_memory_s);
  Vec3 tilt = errors.tilt_rad * normal3(rng), p = Vec3::Zero();
  double heading = 0;
  Trajectory<W> out;
  Pose<W, B> last = flight.at(0);
  p = last.p;
  for (int i = 0; i * dt <= flight.duration_s(); ++i) {
    const Pose<W, B> truth = flight.at(i * dt);
    const Quat turn(Eigen::AngleAxisd(heading, Vec3::UnitZ()));
    p += scale * (turn * (truth.p - last.p)) + errors.position_walk_m_rts * std::sqrt(dt) * normal3(rng);
    last = truth;
    const Vec3 tilt_W(tilt.x(), tilt.y(), 0);
    const Quat q = turn * so3_exp(tilt_W) * truth.q * so3_exp(errors.white_rad * normal3(rng));
    out.push_back({start + Duration::from_seconds(i * dt), {q.normalized(), Vec3(p + errors.white_m * normal3(rng))}});
    heading += errors.heading_walk_rad_rts * std::sqrt(dt) * rng.normal();
    tilt = left * tilt + std::sqrt(1 - left * left) * errors.tilt_rad * normal3(rng);
  }
  return out;
}

/// What is recorded, and what is wrong with it.
struct RecordingFaults {
  double noise_m = 3e-4, noise_rad = 3e-3, stamp_jitter_s = 2e-4;
  int gaps = 3;
  bool jump = true, flip_behind_gap = true;
};

struct MarkerRecording {
  MarkerTrack track;
  MarkerCalibration truth;
};

/// Flight: at(seconds) -> Pose<W, B>, duration_s().
template <class Flight>
MarkerRecording record(const Flight& flight, Time start, const RecordingFaults& faults, std::uint64_t seed, double drift = 0,
                       bool level = false) {
  Rng rng(seed, 13);
  MarkerRecording out;
  MarkerCalibration& c = out.truth;
  const double rate_hz = rng.uniform(100, 240), tilt = level ? 0 : 0.02;
  c.T_BK = {so3_exp(rng.uniform(0, 3) * direction(rng)), Vec3(rng.uniform(0.03, 0.2) * direction(rng))};
  c.T_VW.q = so3_exp(tilt * direction(rng)) * Quat(Eigen::AngleAxisd(rng.uniform(-3, 3), Vec3::UnitZ()));
  c.T_VW.p = 2 * normal3(rng);
  c.drift = drift;
  const Duration lead = Duration::from_seconds(rng.uniform(1, 30));  // recorded before and after the flight
  const Time own_start = Time{} + Duration::from_seconds(rng.uniform(0, 1000));
  c.reference = own_start + lead + Duration::from_seconds(flight.duration_s() / 2);
  c.offset = (start - own_start) - lead;
  struct Span {
    double from, to;
  };
  std::vector<Span> gaps;
  for (int i = 0; i < faults.gaps; ++i) {
    const double from = rng.uniform(5, flight.duration_s() - 8);
    gaps.push_back({from, from + rng.uniform(0.2, 2)});
  }
  const Span jump{rng.uniform(8, 20), 0}, flip{rng.uniform(25, 40), 0};
  const Quat half_turn = so3_exp(std::numbers::pi * direction(rng));
  const Vec3 aside = 0.7 * direction(rng);
  const auto count = static_cast<int>((flight.duration_s() + 2 * lead.seconds()) * rate_hz);
  for (int i = 0; i < count; ++i) {
    const Time s = own_start + Duration::from_seconds(i / rate_hz);
    const double t = (c.to_estimate(s) - start).seconds();
    bool seen = true;
    for (const Span& gap : gaps) seen = seen && !(t > gap.from && t < gap.to);
    if (faults.flip_behind_gap)
      seen = seen && !(t > flip.from - 0.3 && t < flip.from) && !(t > flip.from + 2 && t < flip.from + 2.3);
    if (!seen) continue;
    Pose<V, K> pose = c.T_VW * flight.at(std::clamp(t, 0.0, flight.duration_s())) * c.T_BK;
    if (faults.jump && t > jump.from && t < jump.from + 1) pose.p += aside;
    if (faults.flip_behind_gap && t > flip.from && t < flip.from + 2) pose.q = pose.q * half_turn;
    pose = pose.boxplus(faults.noise_m * normal3(rng), faults.noise_rad * normal3(rng));
    out.track.push_back({s + Duration::from_seconds(faults.stamp_jitter_s * std::clamp(rng.normal(), -3.0, 3.0)), pose});
  }
  return out;
}

/// Lever arm, rotation, clock: found minus true, in the order of HandEye's unknowns.
inline Eigen::Matrix<double, 7, 1> error_of(const MarkerCalibration& found, const MarkerCalibration& truth) {
  Eigen::Matrix<double, 7, 1> e;
  const double clock = (found.to_estimate(found.reference) - truth.to_estimate(found.reference)).seconds();
  e << found.T_BK.p - truth.T_BK.p, so3_log(truth.T_BK.q.conjugate() * found.T_BK.q), clock;
  return e;
}
inline Eigen::Matrix<double, 7, 7> covariance_of(const HandEye& found) {
  constexpr int at[7] = {0, 1, 2, 3, 4, 5, 12};
  Eigen::Matrix<double, 7, 7> out;
  for (int i = 0; i < 7; ++i)
    for (int k = 0; k < 7; ++k) out(i, k) = found.covariance(at[i], at[k]);
  return out;
}

}  // namespace fbvins::test
