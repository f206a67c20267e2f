// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/flight.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/core/rng.hpp"
#include "fbvins/sim/flight_path.hpp"

namespace fbvins {
namespace {

constexpr double kLowest_m = 0.8;   ///< of the waypoint box, above the floor
constexpr double kGround_m = 0.22;  ///< height of a vehicle that stands on its legs

/// A sum of sines with incommensurate frequencies: smooth and bounded.
class Wander {
 public:
  Wander(Rng& rng, double lowest_hz, double highest_hz, double amplitude, int terms = 5) {
    for (int i = 0; i < terms; ++i)
      terms_.push_back({2 * std::numbers::pi * lowest_hz * std::pow(highest_hz / lowest_hz, (i + rng.uniform()) / terms),
                        rng.uniform(0, 2 * std::numbers::pi), amplitude / std::sqrt(terms) * 1.4});
  }
  double operator()(double t) const {
    double sum = 0;
    for (const Term& term : terms_) sum += term.amplitude * std::sin(term.w * t + term.phase);
    return sum;
  }

 private:
  struct Term {
    double w, phase, amplitude;
  };
  std::vector<Term> terms_;
};

struct Wander3 {
  Wander x, y, z;
  Wander3(Rng& rng, double lo, double hi, double amplitude)
      : x(rng, lo, hi, amplitude), y(rng, lo, hi, amplitude), z(rng, lo, hi, amplitude) {}
  Vec3 operator()(double t) const { return {x(t), y(t), z(t)}; }
};

/// 0 before `start`, 1 after `start` + `length`, smooth in between.
double fade_in(double t, double start, double length) {
  const double x = std::clamp((t - start) / length, 0.0, 1.0);
  return x * x * x * x * (35 + x * (-84 + x * (70 - 20 * x)));
}

Vec3 random_waypoint(const FlightOptions& o, Rng& rng) {
  return {o.extent_x_m * rng.uniform(-0.5, 0.5), o.extent_y_m * rng.uniform(-0.5, 0.5), kLowest_m + o.extent_z_m * rng.uniform()};
}

std::vector<Vec3> corners_of(const FlightOptions& o, const std::vector<Vec3>& tour, Rng& rng) {
  const double wanted_m = o.duration_s * o.max_speed_mps + 10;
  std::vector<Vec3> corners;
  if (o.kind == "tour" && tour.size() >= 2) {
    double length = 0;
    for (std::size_t i = 0; length < wanted_m; ++i) {
      corners.push_back(tour[i % tour.size()] + Vec3{rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), rng.uniform(-0.15, 0.15)});
      if (i > 0) length += (corners[i] - corners[i - 1]).norm();
    }
    return corners;
  }
  corners.push_back(random_waypoint(o, rng));
  if (o.kind == "takeoff") corners = {Vec3(corners[0].x(), corners[0].y(), kGround_m), corners[0]};
  const double shortest = 0.3 * std::hypot(o.extent_x_m, o.extent_y_m);
  for (double length = 0; length < wanted_m;) {
    Vec3 next = random_waypoint(o, rng);
    for (int tries = 0; tries < 20 && (next - corners.back()).norm() < shortest; ++tries) next = random_waypoint(o, rng);
    length += (next - corners.back()).norm();
    corners.push_back(next);
  }
  return corners;
}

/// Yaw: the direction of travel, smoothed and rate-limited, plus a slow random variation.
std::vector<double> yaws_along(const TimedPath& path, const FlightOptions& o, Rng& rng) {
  const double dt = path.knot_spacing_s;
  const Wander wander(rng, 0.03, 0.15, 0.25);
  std::vector<double> yaw(path.positions.size(), 0.0);
  double last = 0;
  bool known = false;
  for (std::size_t i = 0; i < yaw.size(); ++i) {
    const std::size_t before = i > 4 ? i - 4 : 0, after = std::min(yaw.size() - 1, i + 4);
    const Vec3 d = path.positions[after] - path.positions[before];
    if (std::hypot(d.x(), d.y()) > 0.25 * dt * static_cast<double>(after - before)) {
      const double heading = std::atan2(d.y(), d.x());
      if (!known) std::fill(yaw.begin(), yaw.begin() + static_cast<std::ptrdiff_t>(i), heading);
      last = known ? last + std::remainder(heading - last, 2 * std::numbers::pi) : heading;
      known = true;
    }
    yaw[i] = last;
  }
  smooth(yaw, static_cast<int>(0.6 / dt), 2, 0.0);
  const double step = o.max_yaw_rate_radps * dt * 0.85;
  for (std::size_t i = 1; i < yaw.size(); ++i) yaw[i] = yaw[i - 1] + std::clamp(yaw[i] - yaw[i - 1], -step, step);
  smooth(yaw, static_cast<int>(0.25 / dt), 3, 0.0);
  for (std::size_t i = 0; i < yaw.size(); ++i) {
    const double t = static_cast<double>(i) * dt;
    yaw[i] += wander(t) * std::min(1.0, o.max_yaw_rate_radps) * fade_in(t, 0.5, 4.0);
  }
  return yaw;
}

/// From control points of position and yaw to a flight whose attitude follows from its acceleration.
SplineTrajectory fly_multirotor(TimedPath path, std::vector<double> yaw, const FlightOptions& o, const Quat& q_VB) {
  const double dt = path.knot_spacing_s;
  const auto rest = static_cast<std::size_t>(o.rest_s / dt) + 3;
  path.positions.insert(path.positions.begin(), rest, Vec3(path.positions.front()));
  yaw.insert(yaw.begin(), rest, double(yaw.front()));
  const auto wanted = static_cast<std::size_t>(o.duration_s / dt) + 7;
  path.positions.resize(wanted, Vec3(path.positions.back()));
  yaw.resize(wanted, double(yaw.back()));

  const SplineTrajectory positions(dt, path.positions, std::vector<Quat>(wanted, Quat::Identity()));
  std::vector<Quat> q;
  for (std::size_t i = 0; i < wanted; ++i) {
    const double t = (static_cast<double>(i) - 2) * dt;  // where control point i has its largest weight
    q.push_back((vehicle_attitude(positions.at(t).a_WB, yaw[i]) * q_VB).normalized());
  }
  return {dt, path.positions, q};
}

SplineTrajectory hover(const FlightOptions& o, const Quat& q_VB, Rng& rng) {
  const Wander3 drift(rng, 0.05, 0.5, 0.08);
  const Wander turn(rng, 0.03, 0.2, 0.12);
  const Vec3 home(0, 0, kLowest_m + 0.5 * o.extent_z_m);
  TimedPath path;
  std::vector<double> yaw;
  const double heading = rng.uniform(-std::numbers::pi, std::numbers::pi);
  for (double t = 0; t < o.duration_s; t += path.knot_spacing_s) {
    const double fade = fade_in(t, 0, 3);
    path.positions.push_back(home + fade * drift(t));
    yaw.push_back(heading + fade * turn(t));
  }
  const double slower = slowdown_needed(path, {o.max_speed_mps, o.max_accel_mps2, o.max_jerk_mps3});
  path.knot_spacing_s *= std::max(1.0, slower);
  return fly_multirotor(path, yaw, o, q_VB);
}

SplineTrajectory handheld(const FlightOptions& o, const Quat& q_VB, Rng& rng) {
  const Wander3 walk(rng, 0.04, 0.3, 0.35), tremble(rng, 1.0, 4.0, 0.035);
  const Wander3 sway(rng, 0.05, 0.5, 0.18), twitch(rng, 1.0, 5.0, 0.06);
  const Wander turn(rng, 0.03, 0.15, 0.9);
  const Vec3 home(0, 0, 1.4);
  const double dt = 0.02;
  std::vector<Vec3> p;
  std::vector<Quat> q;
  for (int i = 0; i < static_cast<int>(o.duration_s / dt) + 7; ++i) {
    const double t = i * dt;
    p.push_back(home + walk(t).cwiseProduct(Vec3(1, 1, 0.4)) + o.shake * tremble(t));
    const Quat heading = so3_exp(Vec3(0, 0, turn(t)));
    q.push_back((heading * so3_exp(sway(t) + o.shake * twitch(t)) * q_VB).normalized());
  }
  return {dt, p, q};
}

}  // namespace

Quat body_in_vehicle(const StereoRig& rig, double camera_pitch_deg) {
  Mat3 R_VC0;  // columns: the camera's right, down and forward in V
  R_VC0 << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Quat pitch = so3_exp(Vec3(0, camera_pitch_deg * std::numbers::pi / 180, 0));
  return (pitch * Quat(R_VC0) * rig.T_BC0().q.conjugate()).normalized();
}

Quat vehicle_attitude(const Vec3& a_WB, double yaw_rad) {
  const Vec3 z = (a_WB + Vec3(0, 0, kSimGravity_mps2)).normalized();
  const Vec3 y = z.cross(Vec3(std::cos(yaw_rad), std::sin(yaw_rad), 0)).normalized();
  Mat3 R;
  R << y.cross(z), y, z;
  return Quat(R).normalized();
}

SplineTrajectory make_flight(const FlightOptions& options, const Quat& q_VB, const std::vector<Vec3>& tour, std::uint64_t seed) {
  Rng rng(seed, 11);
  if (options.kind == "hover") return hover(options, q_VB, rng);
  if (options.kind == "handheld") return handheld(options, q_VB, rng);
  const double radius = options.kind == "aggressive" ? 0.25 : 0.35;
  const MotionLimits limits{options.max_speed_mps, options.max_accel_mps2, options.max_jerk_mps3};
  const TimedPath path = fly_along(corners_of(options, tour, rng), limits, radius);
  return fly_multirotor(path, yaws_along(path, options, rng), options, q_VB);
}

}  // namespace fbvins
