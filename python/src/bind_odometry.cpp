// SPDX-License-Identifier: Apache-2.0
// The estimator's and loop closure's results, image by image.
#include <fmt/format.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <limits>

#include "bindings.hpp"
#include "fbvins/types/loop.hpp"
#include "fbvins/types/odometry.hpp"
#include "fbvins/types/protection.hpp"

namespace fbvins::python {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// NaN where there is no pose: zeros would be a pose at the origin, known exactly.
template <class Derived>
Array<double> known(const Odometry& o, const Eigen::MatrixBase<Derived>& value) {
  auto copy = value.eval();
  if (!o.health.has_pose()) copy.setConstant(kNaN);
  return to_array(copy);
}

template <class To, class From>
Eigen::Matrix4d matrix4(const Pose<To, From>& T) {
  Eigen::Matrix4d out = Eigen::Matrix4d::Identity();
  out.topLeftCorner<3, 3>() = T.R();
  out.topRightCorner<3, 1>() = T.p;
  return out;
}

/// All numbers of an Odometry, in a fixed order.
template <class Take>
void each_number(Odometry& o, Take take) {
  const auto all = [&](auto& m) {
    for (Eigen::Index i = 0; i < m.size(); ++i) take(m.data()[i]);
  };
  all(o.T_WB.p), all(o.T_WB.q.coeffs()), all(o.gauge.T_GB.p), all(o.gauge.T_GB.q.coeffs()), all(o.gauge.v_GB);
  all(o.gauge.q_LG.coeffs()), take(o.gauge.up_sigma_rad), all(o.v_WB), all(o.w_WB_B), all(o.bias.gyro_radps),
      all(o.bias.accel_mps2);
  all(o.pose_covariance), all(o.velocity_covariance), all(o.gyro_bias_covariance), all(o.accel_bias_covariance), all(o.up_W);
  take(o.tilt_sigma_rad), take(o.scale_sigma);
  EstimatorStats& s = o.stats;
  for (double* x : {&s.initial_cost, &s.final_cost, &s.prepare_ms, &s.solve_ms, &s.marginalise_ms}) take(*x);
}
using OdometryState = std::tuple<std::vector<std::int64_t>, std::vector<double>>;

OdometryState state_of(Odometry& o) {
  const EstimatorStats& s = o.stats;
  OdometryState out{{o.id.value, o.t.ns, o.level, static_cast<int>(o.health.state), static_cast<int>(o.health.reason),
                     o.health.without_cameras, o.reset_counter, s.frames_in_window, s.landmarks, s.known_landmarks,
                     s.observations, s.iterations, s.outliers, s.keyframe, s.standstill},
                    {}};
  each_number(o, [&](double x) { std::get<1>(out).push_back(x); });
  return out;
}

void set_state(Odometry& self, const OdometryState& state) {
  new (&self) Odometry();
  const auto& [whole, numbers] = state;
  std::size_t i = 0, k = 0;
  const auto next = [&] { return whole.at(i++); };
  self.id = FrameId{next()}, self.t = Time{next()}, self.level = next() != 0;
  self.health.state = static_cast<HealthState>(next()), self.health.reason = static_cast<HealthReason>(next());
  self.health.without_cameras = static_cast<std::uint8_t>(next());
  self.reset_counter = static_cast<std::uint32_t>(next());
  EstimatorStats& s = self.stats;
  for (int* count : {&s.frames_in_window, &s.landmarks, &s.known_landmarks, &s.observations, &s.iterations, &s.outliers})
    *count = static_cast<int>(next());
  s.keyframe = next() != 0, s.standstill = next() != 0;
  each_number(self, [&](double& x) { x = numbers.at(k++); });
}

void bind_pose(nb::module_& m) {
  nb::class_<Odometry>(m, "Odometry",
                       "One pose of the flight, at an image's stamp. W is gravity-aligned (z up) as far as gravity is known, and "
                       "never jumps unless reset_counter increases; B is the IMU.")
      .def_prop_ro(
          "frame", [](const Odometry& o) { return o.id.value; }, "counts the images from 0")
      .def_prop_ro(
          "t", [](const Odometry& o) { return o.t.ns; }, "ns of the cameras' clock")
      .def_prop_ro(
          "has_pose", [](const Odometry& o) { return o.health.has_pose(); }, "False: all numbers of the estimate are NaN")
      .def_prop_ro(
          "p", [](const Odometry& o) { return known(o, o.T_WB.p); }, "(3,), p_WB, m in W")
      .def_prop_ro(
          "q", [](const Odometry& o) { return known(o, wxyz(o.T_WB.q)); }, "(4,), body to W, w first")
      .def_prop_ro(
          "T_WB", [](const Odometry& o) { return known(o, matrix4(o.T_WB)); }, "(4, 4), takes body to W")
      .def_prop_ro(
          "T_GB", [](const Odometry& o) { return known(o, matrix4(o.gauge.T_GB)); }, "(4, 4), in the gauge frame G")
      .def_prop_ro(
          "v", [](const Odometry& o) { return known(o, o.v_WB); }, "(3,), v_WB, m/s in W")
      .def_prop_ro(
          "w", [](const Odometry& o) { return known(o, o.w_WB_B); }, "(3,), w_WB_B, rad/s in B, bias removed")
      .def_prop_ro(
          "gyro_bias", [](const Odometry& o) { return known(o, o.bias.gyro_radps); }, "(3,), rad/s")
      .def_prop_ro(
          "accel_bias", [](const Odometry& o) { return known(o, o.bias.accel_mps2); }, "(3,), m/s^2")
      .def_prop_ro(
          "covariance", [](const Odometry& o) { return known(o, o.pose_covariance); },
          "(6, 6), of (dp in W [m], dtheta in B [rad])")
      .def_prop_ro(
          "velocity_covariance", [](const Odometry& o) { return known(o, o.velocity_covariance); }, "(3, 3), m^2/s^2")
      .def_prop_ro(
          "health", [](const Odometry& o) { return std::string(to_string(o.health.state)); },
          "initialising, good, degraded or lost")
      .def_prop_ro("reason", [](const Odometry& o) { return std::string(to_string(o.health.reason)); })
      .def_prop_ro(
          "without_cameras", [](const Odometry& o) { return cameras_in(o.health.without_cameras); },
          "numbers of the cameras that deliver nothing or contradict the others, and are not used")
      .def_ro("level", &Odometry::level, "whether the tilt is known to 0.3 degrees")
      .def_prop_ro("tilt_sigma_rad", [](const Odometry& o) { return o.health.has_pose() ? o.tilt_sigma_rad : kNaN; })
      .def_prop_ro(
          "scale_sigma", [](const Odometry& o) { return o.health.has_pose() && o.scale_sigma > 0 ? o.scale_sigma : kNaN; },
          "relative standard deviation of the scale, of a rig with one camera; NaN with a pair, which knows it")
      .def_prop_ro(
          "protection_m", [](const Odometry& o) { return protection_level_m(o.health, o.pose_covariance); },
          "radius that the position's error is meant to exceed once in 10^4 poses at most, m; inf without a pose")
      .def_ro("reset_counter", &Odometry::reset_counter, "+1 whenever the estimator restarts: W is a new frame then")
      .def("__getstate__", &state_of)
      .def("__setstate__", &set_state)
      .def("__repr__", [](const Odometry& o) {
        return fmt::format("<fbvins.Odometry frame {} t={} ns {} p=({:.3f}, {:.3f}, {:.3f})>", o.id.value, o.t.ns,
                           to_string(o.health.state), o.T_WB.p.x(), o.T_WB.p.y(), o.T_WB.p.z());
      });
}

void bind_map_update(nb::module_& m) {
  nb::class_<MapUpdate>(m, "MapUpdate",
                        "Result of loop closure after a keyframe: T_MB = T_MW T_WB. M is gravity-aligned, see M_moved.")
      .def_prop_ro(
          "t", [](const MapUpdate& u) { return u.t.ns; }, "ns, of the keyframe")
      .def_prop_ro("frame", [](const MapUpdate& u) { return u.frame.value; })
      .def_prop_ro(
          "applies_from", [](const MapUpdate& u) { return u.applies_from.value; }, "the first frame after it")
      .def_ro("localised", &MapUpdate::localised, "False: the pose of W in M is unknown")
      .def_ro("found", &MapUpdate::found, "it is known again from this update on: after a restart, or first in a loaded map")
      .def_prop_ro(
          "T_MW", [](const MapUpdate& u) { return to_array(u.T_MW); }, "(4, 4); jumps when a place is recognised")
      .def_prop_ro(
          "T_MW_smooth", [](const MapUpdate& u) { return to_array(u.T_MW_smooth); }, "(4, 4), without jumps, for control")
      .def_prop_ro(
          "T_MG", [](const MapUpdate& u) { return to_array(u.T_MG); }, "(4, 4)")
      .def_ro("anchored", &MapUpdate::anchored, "M is the frame of the building, by anchors")
      .def_prop_ro(
          "M_moved", [](const MapUpdate& u) { return u.M_moved ? nb::cast(to_array(*u.M_moved)) : nb::object(nb::none()); },
          "None, or (4, 4) where M is another frame from this update on, levelled or the building's: takes coordinates in the M "
          "of before to the new one")
      .def_prop_ro(
          "anchors", [](const MapUpdate& u) { return u.stats.anchors; }, "anchors that moved M")
      .def_prop_ro("anchors_refused", [](const MapUpdate& u) { return u.stats.anchors_refused; })
      .def_prop_ro(
          "loops", [](const MapUpdate& u) { return u.loops.size(); }, "places recognised")
      .def_prop_ro(
          "keyframes", [](const MapUpdate& u) { return u.stats.keyframes; }, "in the map")
      .def("__repr__", [](const MapUpdate& u) {
        return fmt::format("<fbvins.MapUpdate t={} ns, {} keyframes, {} loops>", u.t.ns, u.stats.keyframes, u.loops.size());
      });
}

}  // namespace

void bind_odometry(nb::module_& m) {
  bind_pose(m);
  bind_map_update(m);
}

}  // namespace fbvins::python
