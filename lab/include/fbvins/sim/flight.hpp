// SPDX-License-Identifier: Apache-2.0
// Synthetic flights: hover, waypoints within a quadrotor's limits, aggressive, hand-held, take-off, tour.
// The world has z up and the floor at z = 0; V is the vehicle: x forward, y left, z up.
// Pure functions, any thread; the same options and seed give the same bits.
//
//   FlightOptions options;
//   options.kind = "aggressive";
//   SplineTrajectory flight = make_flight(options, body_in_vehicle(rig, options.camera_pitch_deg), tour, seed);
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/sim/spline.hpp"

namespace fbvins {

struct FlightOptions {
  std::string kind = "waypoint";
  double duration_s = 30;
  double rest_s = 1.0;
  double max_speed_mps = 1.0;
  double max_accel_mps2 = 2.0;
  double max_jerk_mps3 = 10.0;
  double max_yaw_rate_radps = 0.8;
  double extent_x_m = 5, extent_y_m = 4, extent_z_m = 1.2;
  double camera_pitch_deg = 5;
  double shake = 1.0;

  template <class V>
  void visit(V&& v) {
    v("kind", kind, "hover|waypoint|aggressive|handheld|takeoff|tour", "how the camera moves");
    v("duration_s", duration_s, "s", "length of the flight, rest included", 2.0, 3600.0);
    v("rest_s", rest_s, "s", "rest at the start (not handheld)", 0.0, 60.0);
    v("max_speed_mps", max_speed_mps, "m/s", "never exceeded", 0.05, 30.0);
    v("max_accel_mps2", max_accel_mps2, "m/s^2", "never exceeded", 0.1, 100.0);
    v("max_jerk_mps3", max_jerk_mps3, "m/s^3", "never exceeded", 0.5, 2000.0);
    v("max_yaw_rate_radps", max_yaw_rate_radps, "rad/s", "largest yaw rate of the flight", 0.05, 10.0);
    v("extent_x_m", extent_x_m, "m", "size of the waypoints' box along x, centred over the world's origin", 0.2, 500.0);
    v("extent_y_m", extent_y_m, "m", "its size along y", 0.2, 500.0);
    v("extent_z_m", extent_z_m, "m", "its height; it begins 0.8 m above the floor", 0.1, 50.0);
    v("camera_pitch_deg", camera_pitch_deg, "deg", "the cameras look down by this much at level flight", -60.0, 90.0);
    v("shake", shake, "", "strength of the hand's tremor (handheld)", 0.0, 5.0);
  }
};

/// Rotation from body to vehicle axes for cameras that look forwards, pitched down.
Quat body_in_vehicle(const StereoRig& rig, double camera_pitch_deg);

/// `tour`: the corners that a flight of kind "tour" visits again and again (z included).
SplineTrajectory make_flight(const FlightOptions& options, const Quat& q_VB, const std::vector<Vec3>& tour, std::uint64_t seed);

/// Attitude of a multirotor with thrust along a_WB less gravity, and heading `yaw_rad`.
Quat vehicle_attitude(const Vec3& a_WB, double yaw_rad);

}  // namespace fbvins
