// SPDX-License-Identifier: Apache-2.0
// Options of what is sent to a flight controller: `live.mavlink` in a configuration (docs/px4.md). SI units, radians.
#pragma once

#include <string>

#include "fbvins/mavlink/aiding_options.hpp"
#include "fbvins/mavlink/mounting_options.hpp"

namespace fbvins {

/// px4: ODOMETRY, with NaN while there is no pose. ardupilot: ODOMETRY in LOCAL_FRD, as EKF3 takes it: nothing before the first
/// pose, and never NaN (docs/px4.md, ArduPilot). vision_estimate: VISION_POSITION_ESTIMATE and VISION_SPEED_ESTIMATE.
enum class MavlinkDialect { px4, ardupilot, vision_estimate };

/// Of ODOMETRY's pose. local_ned: x is said to point north (docs/px4.md, LOCAL_NED).
enum class MavlinkFrameId { local_frd, local_ned };

/// Whose clock the stamps are on. flight_controller: no pose is sent before that is known. own: this computer's, for flight
/// controllers and loggers that do not answer TIMESYNC.
enum class MavlinkClock { flight_controller, own };

/// Whose UDP packets are taken. address: those of the host and port that are sent to. first: those of the sender of the first
/// heartbeat of a flight controller, to which poses go from then on.
enum class MavlinkUdpPeer { address, first };

struct MavlinkOptions {
  MavlinkDialect dialect = MavlinkDialect::px4;
  MavlinkFrameId frame = MavlinkFrameId::local_frd;
  MavlinkClock clock = MavlinkClock::flight_controller;
  MavlinkUdpPeer udp_peer = MavlinkUdpPeer::address;
  double rate_hz = 50;
  int system_id = 1;
  int component_id = 197;
  std::string origin = "";
  std::string key_file = "";
  std::string key_time_file = "mavlink_signing_time";
  MountingOptions mounting = {};
  MavlinkAidingOptions sensors = {};

  template <class V>
  void visit(V&& v) {
    v("dialect", dialect, "px4|ardupilot|vision_estimate", "who takes the poses, or which messages carry them");
    v("frame", frame, "local_frd|local_ned", "frame of the pose in ODOMETRY; local_ned says that its x points north");
    v("clock", clock, "flight_controller|own",
      "whose clock stamps are on; no pose is sent before the flight controller's is known");
    v("udp_peer", udp_peer, "address|first",
      "whose UDP packets are taken: the address's, or those of the first flight controller heard");
    v("rate_hz", rate_hz, "Hz", "poses sent per second, no more than the IMU's rate", 1.0, 1000.0);
    v("system_id", system_id, "", "the vehicle's number (PX4 MAV_SYS_ID, ArduPilot SYSID_THISMAV)", 1, 255);
    v("component_id", component_id, "", "component of this computer; 197: visual-inertial odometry", 1, 255);
    v("origin", origin, "",
      "LATITUDE,LONGITUDE,ALTITUDE in degrees and metres: told a flight controller without GPS as its EKF's origin; empty: it is not told");
    v("key_file", key_file, "", "file of the 32-byte key of MAVLink signing; empty: frames are not signed");
    v("key_time_file", key_time_file, "", "with a key: file that keeps the times of signatures growing over restarts");
    v.group("mounting", mounting, "the IMU on the vehicle, and the local frame");
    v.group("sensors", sensors, "sensors of the flight controller that aid images and IMU");
  }
};

}  // namespace fbvins
