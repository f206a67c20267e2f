// SPDX-License-Identifier: Apache-2.0
// A rig's calibration as the parameters that a flight may refine: their names, how far from the truth a given one is expected to
// be, and steps of them. Pure functions, any thread.
//
//   FlightRig rig = flight_rig(stereo_rig);
//   rig = moved(rig, step);                     // one number a parameter, in the order of flight_parameters(rig)
//   StereoRig refined = refined_rig(stereo_rig, rig);
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fbvins/calibration/board_view.hpp"
#include "fbvins/calibration/imu_camera.hpp"
#include "fbvins/camera/camera.hpp"

namespace fbvins {

struct FlightRig {
  std::vector<Camera> cameras;
  Pose<B, C0> T_BC0;
  std::vector<Pose<Cn, C0>> T_CnC0;  ///< the first: identity
  double time_offset_s = 0;          ///< t_imu = t_image + time_offset_s
  ImuTriads axes;                    ///< of the IMU, beyond those of the calibration given
};

/// What is kept or changed together.
enum class FlightGroup {
  lever,
  mounting,
  time_offset,
  baseline,
  between_cameras,
  focal,
  centre,
  distortion,
  gyro_axes,
  accel_axes
};

struct FlightParameter {
  std::string name, unit;
  FlightGroup group;
  int camera = 0;
  double prior_sigma = 0;  ///< how far from the truth the given value is expected to be, in `unit`
};

FlightRig flight_rig(const StereoRig& rig);
/// `rig` with the calibration found; its IMU's axes are those of `rig` followed by those found.
StereoRig refined_rig(StereoRig rig, const FlightRig& found);

std::vector<FlightParameter> flight_parameters(const FlightRig& rig);
/// The parameters as numbers; rotations as rotation vectors.
Eigen::VectorXd values(const FlightRig& rig);
/// After a step: translations and all other numbers are added to, rotations turned on the right.
FlightRig moved(const FlightRig& rig, const Eigen::VectorXd& step);
/// The step from one rig to another.
Eigen::VectorXd step_between(const FlightRig& from, const FlightRig& to);

/// Where parameters begin.
namespace flight {
inline constexpr int lever = 0, mounting = 3, time_offset = 6, gyro = 7, accel = 16, cameras = 22;
/// Of a camera: T_CnC0 (not of the first), then its lens.
int first_of(const FlightRig& rig, int camera);
}  // namespace flight

}  // namespace fbvins
