// SPDX-License-Identifier: Apache-2.0
// The MAVLink messages of a mission flown by a companion computer, and of a simulator that stands in for a vehicle's sensors.
// Fields, names and units are those of the protocol's common set, as in messages.hpp.
#pragma once

#include <array>
#include <cstdint>

namespace fbvins {

/// MAV_FRAME, MAV_CMD, MAV_RESULT and MAV_LANDED_STATE, as far as used here.
inline constexpr std::uint8_t kMavFrameLocalNed = 1;
inline constexpr std::uint16_t kMavCmdLand = 21, kMavCmdTakeOff = 22, kMavCmdSetMode = 176, kMavCmdArm = 400,
                               kMavCmdSetMessageInterval = 511, kMavCmdSetEkfSourceSet = 42007;
inline constexpr std::uint8_t kMavResultAccepted = 0;
inline constexpr std::uint8_t kMavLandedOnGround = 1;

/// SET_POSITION_TARGET_LOCAL_NED, a setpoint; fields whose bit is set in type_mask are ignored.
struct PositionTargetMessage {
  static constexpr std::uint32_t kId = 84;
  static constexpr std::uint8_t kCrcExtra = 143;

  std::uint32_t time_boot_ms = 0;
  float x = 0, y = 0, z = 0;        ///< m, in coordinate_frame
  float vx = 0, vy = 0, vz = 0;     ///< m/s
  float afx = 0, afy = 0, afz = 0;  ///< m/s^2
  float yaw = 0, yaw_rate = 0;      ///< rad, rad/s
  std::uint16_t type_mask = 0;
  std::uint8_t target_system = 1, target_component = 1;
  std::uint8_t coordinate_frame = kMavFrameLocalNed;

  template <class V>
  void wire(V&& v) {
    v(time_boot_ms), v(x), v(y), v(z), v(vx), v(vy), v(vz), v(afx), v(afy), v(afz), v(yaw), v(yaw_rate), v(type_mask);
    v(target_system), v(target_component), v(coordinate_frame);
  }
};

struct CommandMessage {
  static constexpr std::uint32_t kId = 76;
  static constexpr std::uint8_t kCrcExtra = 152;

  std::array<float, 7> params{};
  std::uint16_t command = 0;
  std::uint8_t target_system = 1, target_component = 1;
  std::uint8_t confirmation = 0;

  template <class V>
  void wire(V&& v) {
    v(params), v(command), v(target_system), v(target_component), v(confirmation);
  }
};

struct CommandAckMessage {
  static constexpr std::uint32_t kId = 77;
  static constexpr std::uint8_t kCrcExtra = 143;

  std::uint16_t command = 0;
  std::uint8_t result = 0;
  std::uint8_t progress = 0;
  std::int32_t result_param2 = 0;
  std::uint8_t target_system = 0, target_component = 0;

  template <class V>
  void wire(V&& v) {
    v(command), v(result), v(progress), v(result_param2), v(target_system), v(target_component);
  }
};

/// LOCAL_POSITION_NED: the flight controller's own estimate.
struct LocalPositionMessage {
  static constexpr std::uint32_t kId = 32;
  static constexpr std::uint8_t kCrcExtra = 185;

  std::uint32_t time_boot_ms = 0;
  float x = 0, y = 0, z = 0;     ///< m, north-east-down
  float vx = 0, vy = 0, vz = 0;  ///< m/s

  template <class V>
  void wire(V&& v) {
    v(time_boot_ms), v(x), v(y), v(z), v(vx), v(vy), v(vz);
  }
};

struct AttitudeQuaternionMessage {
  static constexpr std::uint32_t kId = 31;
  static constexpr std::uint8_t kCrcExtra = 246;

  std::uint32_t time_boot_ms = 0;
  float q1 = 1, q2 = 0, q3 = 0, q4 = 0;               ///< w first, forward-right-down to north-east-down
  float rollspeed = 0, pitchspeed = 0, yawspeed = 0;  ///< rad/s
  std::array<float, 4> repr_offset_q{};

  template <class V>
  void wire(V&& v) {
    v(time_boot_ms), v(q1), v(q2), v(q3), v(q4), v(rollspeed), v(pitchspeed), v(yawspeed), v(repr_offset_q);
  }
};

/// GPS_GLOBAL_ORIGIN: where the flight controller's local frame is on the Earth, as it says once it is set.
struct KnownOriginMessage {
  static constexpr std::uint32_t kId = 49;
  static constexpr std::uint8_t kCrcExtra = 39;

  std::int32_t latitude = 0, longitude = 0;  ///< degrees times 1e7
  std::int32_t altitude = 0;                 ///< mm above sea level
  std::uint64_t time_usec = 0;

  template <class V>
  void wire(V&& v) {
    v(latitude), v(longitude), v(altitude), v(time_usec);
  }
};

/// SET_GPS_GLOBAL_ORIGIN: where the local frame's origin is on the Earth.
struct GlobalOriginMessage {
  static constexpr std::uint32_t kId = 48;
  static constexpr std::uint8_t kCrcExtra = 41;

  std::int32_t latitude = 0, longitude = 0;  ///< degrees times 1e7
  std::int32_t altitude = 0;                 ///< mm above sea level
  std::uint8_t target_system = 1;
  std::uint64_t time_usec = 0;

  template <class V>
  void wire(V&& v) {
    v(latitude), v(longitude), v(altitude), v(target_system), v(time_usec);
  }
};

struct LandedStateMessage {
  static constexpr std::uint32_t kId = 245;
  static constexpr std::uint8_t kCrcExtra = 130;

  std::uint8_t vtol_state = 0, landed_state = 0;

  template <class V>
  void wire(V&& v) {
    v(vtol_state), v(landed_state);
  }
};

/// Sensor data of a simulated vehicle, forward-right-down.
struct HilSensorMessage {
  static constexpr std::uint32_t kId = 107;
  static constexpr std::uint8_t kCrcExtra = 108;
  /// Of fields_updated.
  static constexpr std::uint32_t kImu = 0b111111, kBarometer = 0b1101000000000;

  std::uint64_t time_usec = 0;
  float xacc = 0, yacc = 0, zacc = 0;         ///< m/s^2
  float xgyro = 0, ygyro = 0, zgyro = 0;      ///< rad/s
  float xmag = 0, ymag = 0, zmag = 0;         ///< gauss
  float abs_pressure = 0, diff_pressure = 0;  ///< hPa
  float pressure_alt = 0;                     ///< m
  float temperature = 0;                      ///< deg C
  std::uint32_t fields_updated = 0;
  std::uint8_t id = 0;

  template <class V>
  void wire(V&& v) {
    v(time_usec), v(xacc), v(yacc), v(zacc), v(xgyro), v(ygyro), v(zgyro), v(xmag), v(ymag), v(zmag);
    v(abs_pressure), v(diff_pressure), v(pressure_alt), v(temperature), v(fields_updated), v(id);
  }
};

struct HilActuatorControlsMessage {
  static constexpr std::uint32_t kId = 93;
  static constexpr std::uint8_t kCrcExtra = 47;

  std::uint64_t time_usec = 0, flags = 0;
  std::array<float, 16> controls{};  ///< of motors: 0 to 1
  std::uint8_t mode = 0;             ///< MAV_MODE_FLAG

  template <class V>
  void wire(V&& v) {
    v(time_usec), v(flags), v(controls), v(mode);
  }
};

}  // namespace fbvins
