// SPDX-License-Identifier: Apache-2.0
// From this project's frames to a flight controller's: the only place that uses forward-right-down.
//
//   VehicleFrames frames(mounting);
//   if (std::optional<VehicleState> state = frames.state(odometry)) link.send(odometry_message(*state, stamp_usec));
#pragma once

#include <cstdint>
#include <optional>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/mavlink/flown_map.hpp"
#include "fbvins/mavlink/messages.hpp"
#include "fbvins/mavlink/mounting_options.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

struct BodyFrd {};   ///< the vehicle: x forward, y right, z down, origin at the flight controller
struct BaseLink {};  ///< the same vehicle as ROS has it (REP 105): x forward, y left, z up; where there is none, the IMU
struct LocalFrd {};  ///< z down; see LocalOrigin

/// Pose of the IMU on the vehicle.
Pose<BodyFrd, B> mounting(const MountingOptions& options);
/// The same mounting in ROS's axes.
Pose<B, BaseLink> base_link(const MountingOptions& options);

struct VehicleState {
  Pose<LocalFrd, BodyFrd> T_LF;
  Vec3 v_LF_F = Vec3::Zero();               ///< m/s
  Vec3 w_LF_F = Vec3::Zero();               ///< rad/s
  Mat6 pose_covariance = Mat6::Zero();      ///< of (dp in L [m], dtheta in L [rad])
  Mat3 velocity_covariance = Mat3::Zero();  ///< of v_LF_F
  Health health;
  std::uint32_t reset_counter = 0;  ///< of the odometry; with LocalOrigin::map plus FlownMap::jumps()
};

class VehicleFrames {
 public:
  explicit VehicleFrames(const MountingOptions& options);
  /// None without a pose, or with numbers that are not finite. At a reset a flight controller takes over position and heading:
  /// the less they jump, the less its filter is disturbed (LocalOrigin::vehicle).
  std::optional<VehicleState> state(const Odometry& odometry);
  /// Where M is; has an effect with LocalOrigin::map alone.
  void take(const MapUpdate& update);
  /// A counter of the odometry, as VehicleState has it.
  std::uint32_t reset_counter(std::uint32_t odometrys) const { return odometrys + map_.jumps(); }

 private:
  void begin(const Pose<W, BodyFrd>& T_WF);

  LocalOrigin origin_;
  Pose<B, BodyFrd> T_BF_;
  Pose<LocalFrd, W> T_LW_;
  FlownMap map_;
  std::optional<std::uint32_t> reset_counter_;
  std::optional<Pose<LocalFrd, BodyFrd>> last_;
};

/// Percent as in ODOMETRY: that of types/quality.hpp where there is a pose, 0 before the start, -1 when lost.
std::int8_t odometry_quality(const Health& health, const Mat6& pose_covariance);

OdometryMessage odometry_message(const VehicleState& state, std::uint64_t time_usec);
/// All numbers unknown (NaN): reports that there is no pose.
OdometryMessage no_odometry_message(const Health& health, std::uint32_t reset_counter, std::uint64_t time_usec);
VisionPositionMessage vision_position_message(const VehicleState& state, std::uint64_t time_usec);
VisionSpeedMessage vision_speed_message(const VehicleState& state, std::uint64_t time_usec);
StatusTextMessage health_message(const Health& health);

}  // namespace fbvins
