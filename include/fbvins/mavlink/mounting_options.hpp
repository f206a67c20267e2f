// SPDX-License-Identifier: Apache-2.0
// How the IMU is mounted on a vehicle, and where the vehicle's local frame lies: of MAVLink and ROS 2. Metres, radians.
#pragma once

namespace fbvins {

/// Directions of the axes of the IMU's frame B on the vehicle, before the mounting's angles.
enum class ImuAxes {
  frd,         ///< x forward, y right, z down
  flu,         ///< x forward, y left, z up
  camera_fwd,  ///< x right, y down, z forward, as in cameras that look ahead
  camera_down  ///< x right, y backward, z down, as in cameras that look at the ground
};

/// vehicle: x ahead of the vehicle at the start; after a restart the frame continues where the vehicle was last seen.
/// world: W turned by 180 degrees about its x. map: M turned so (FlownMap);
/// before the vehicle is found in it, as world, and after a restart as vehicle.
enum class LocalOrigin { vehicle, world, map };

struct MountingOptions {
  ImuAxes imu_axes = ImuAxes::flu;
  double roll_rad = 0, pitch_rad = 0, yaw_rad = 0;
  double x_m = 0, y_m = 0, z_m = 0;
  LocalOrigin local_frame = LocalOrigin::vehicle;

  template <class V>
  void visit(V&& v) {
    v("imu_axes", imu_axes, "frd|flu|camera_fwd|camera_down", "directions of the IMU's axes on the vehicle");
    v("roll_rad", roll_rad, "rad", "the IMU is turned by this about the vehicle's forward axis", -3.2, 3.2);
    v("pitch_rad", pitch_rad, "rad", "then pitched up by this", -3.2, 3.2);
    v("yaw_rad", yaw_rad, "rad", "then turned to the right by this", -3.2, 3.2);
    v("x_m", x_m, "m", "the IMU's position on the vehicle, forward", -10.0, 10.0);
    v("y_m", y_m, "m", "the IMU's position on the vehicle, right", -10.0, 10.0);
    v("z_m", z_m, "m", "the IMU's position on the vehicle, down", -10.0, 10.0);
    v("local_frame", local_frame, "vehicle|world|map",
      "x ahead of the vehicle at the start, continued after a restart; or W, or the map's M, with z down");
  }
};

}  // namespace fbvins
