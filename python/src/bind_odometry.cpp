// SPDX-License-Identifier: Apache-2.0
// The estimator's and loop closure's results, image by image.
#include <fmt/format.h>

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

}  // namespace

void bind_odometry(nb::module_& m) {
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
      .def_ro("level", &Odometry::level, "whether the tilt is known to 0.3 degrees")
      .def_prop_ro("tilt_sigma_rad", [](const Odometry& o) { return o.health.has_pose() ? o.tilt_sigma_rad : kNaN; })
      .def_prop_ro(
          "protection_m", [](const Odometry& o) { return protection_level_m(o.health, o.pose_covariance); },
          "radius that the position's error exceeds once in 10^4 poses at most, m; inf without a pose")
      .def_ro("reset_counter", &Odometry::reset_counter, "+1 whenever the estimator restarts: W is a new frame then")
      .def("__repr__", [](const Odometry& o) {
        return fmt::format("<fbvins.Odometry frame {} t={} ns {} p=({:.3f}, {:.3f}, {:.3f})>", o.id.value, o.t.ns,
                           to_string(o.health.state), o.T_WB.p.x(), o.T_WB.p.y(), o.T_WB.p.z());
      });

  nb::class_<MapUpdate>(m, "MapUpdate", "Result of loop closure after a keyframe: T_MB = T_MW T_WB. M is gravity-aligned.")
      .def_prop_ro(
          "t", [](const MapUpdate& u) { return u.t.ns; }, "ns, of the keyframe")
      .def_prop_ro("frame", [](const MapUpdate& u) { return u.frame.value; })
      .def_prop_ro(
          "applies_from", [](const MapUpdate& u) { return u.applies_from.value; }, "the first frame after it")
      .def_ro("localised", &MapUpdate::localised, "False: the pose of W in M is unknown")
      .def_prop_ro(
          "T_MW", [](const MapUpdate& u) { return to_array(u.T_MW); }, "(4, 4); jumps when a place is recognised")
      .def_prop_ro(
          "T_MW_smooth", [](const MapUpdate& u) { return to_array(u.T_MW_smooth); }, "(4, 4), without jumps, for control")
      .def_prop_ro(
          "T_MG", [](const MapUpdate& u) { return to_array(u.T_MG); }, "(4, 4)")
      .def_prop_ro(
          "loops", [](const MapUpdate& u) { return u.loops.size(); }, "places recognised")
      .def_prop_ro(
          "keyframes", [](const MapUpdate& u) { return u.stats.keyframes; }, "in the map")
      .def("__repr__", [](const MapUpdate& u) {
        return fmt::format("<fbvins.MapUpdate t={} ns, {} keyframes, {} loops>", u.t.ns, u.stats.keyframes, u.loops.size());
      });
}

}  // namespace fbvins::python
