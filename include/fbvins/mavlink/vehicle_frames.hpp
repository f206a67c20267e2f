// SPDX-License-Identifier: Apache-2.0
// From this project's frames to a flight controller's: the only place that knows of forward-right-down.
//
//   VehicleFrames frames(mounting);
//   if (std::optional<VehicleState> state = frames.state(odometry)) link.send(odometry_message(*state, stamp_usec));
#pragma once

#include <cstdint>
#include <optional>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/mavlink/messages.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

struct BodyFrd {};   ///< the vehicle: x forward, y right, z down, origin where its flight controller says
struct LocalFrd {};  ///< W with z down, and x forward at the start (or W's own x)

/// Which way the axes of the IMU's frame B look on the vehicle, before the mounting's angles.
enum class ImuAxes {
  frd,         ///< x forward, y right, z down
  flu,         ///< x forward, y left, z up
  camera_fwd,  ///< x right, y down, z forward, as in cameras that look ahead
  camera_down  ///< x right, y backward, z down, as in cameras that look at the ground
};

/// Whether the local frame looks to where the vehicle looked at the start.
enum class LocalHeading { vehicle, world };

struct MountingOptions {
  ImuAxes imu_axes = ImuAxes::flu;
  double roll_rad = 0, pitch_rad = 0, yaw_rad = 0;
  double x_m = 0, y_m = 0, z_m = 0;
  LocalHeading heading = LocalHeading::vehicle;

  template <class V>
  void visit(V&& v) {
    v("imu_axes", imu_axes, "frd|flu|camera_fwd|camera_down", "which way the IMU's axes look on the vehicle");
    v("roll_rad", roll_rad, "rad", "the IMU is turned by this about the vehicle's forward axis", -3.2, 3.2);
    v("pitch_rad", pitch_rad, "rad", "then pitched up by this", -3.2, 3.2);
    v("yaw_rad", yaw_rad, "rad", "then turned to the right by this", -3.2, 3.2);
    v("x_m", x_m, "m", "the IMU's place on the vehicle, forward", -10.0, 10.0);
    v("y_m", y_m, "m", "the IMU's place on the vehicle, right", -10.0, 10.0);
    v("z_m", z_m, "m", "the IMU's place on the vehicle, down", -10.0, 10.0);
    v("heading", heading, "vehicle|world", "x of the local frame: ahead of the vehicle at the start, or the world's own");
  }
};

/// The IMU on the vehicle.
Pose<BodyFrd, B> mounting(const MountingOptions& options);

struct VehicleState {
  Pose<LocalFrd, BodyFrd> T_LF;
  Vec3 v_LF_F = Vec3::Zero();               ///< m/s
  Vec3 w_LF_F = Vec3::Zero();               ///< rad/s
  Mat6 pose_covariance = Mat6::Zero();      ///< of (dp in L [m], dtheta in L [rad])
  Mat3 velocity_covariance = Mat3::Zero();  ///< of v_LF_F
  Health health;
  std::uint32_t reset_counter = 0;
};

class VehicleFrames {
 public:
  explicit VehicleFrames(const MountingOptions& options);
  /// The heading of the local frame is taken from the first odometry that has a pose, and anew at each reset.
  /// Without a pose, or with numbers that are not finite, there is none.
  std::optional<VehicleState> state(const Odometry& odometry);

 private:
  LocalHeading heading_;
  Pose<B, BodyFrd> T_BF_;
  Quat q_LW_;
  std::optional<std::uint32_t> reset_counter_;
};

/// Percent as ODOMETRY has it: positive only where one may fly by this pose.
std::int8_t odometry_quality(const Health& health);

OdometryMessage odometry_message(const VehicleState& state, std::uint64_t time_usec);
/// All unknown: what says that there is no pose.
OdometryMessage no_odometry_message(const Health& health, std::uint32_t reset_counter, std::uint64_t time_usec);
VisionPositionMessage vision_position_message(const VehicleState& state, std::uint64_t time_usec);
VisionSpeedMessage vision_speed_message(const VehicleState& state, std::uint64_t time_usec);
StatusTextMessage health_message(const Health& health);

}  // namespace fbvins
