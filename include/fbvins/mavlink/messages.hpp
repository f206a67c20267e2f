// SPDX-License-Identifier: Apache-2.0
// The MAVLink messages of an onboard computer that estimates motion, as values. Fields, names and units are those of the
// protocol's common set; each wire() lists them in their order on the wire, extensions last.
//
//   std::vector<std::uint8_t> bytes = encode_mavlink(HeartbeatMessage{}, MavlinkAddress{}, sequence++);
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <variant>

#include "fbvins/mavlink/flight_messages.hpp"
#include "fbvins/mavlink/parameter_messages.hpp"
#include "fbvins/mavlink/sensor_messages.hpp"

namespace fbvins {

/// MAV_FRAME, MAV_ESTIMATOR_TYPE, MAV_STATE and MAV_SEVERITY, as far as used here.
inline constexpr std::uint8_t kMavFrameBodyFrd = 12, kMavFrameLocalFrd = 20;
inline constexpr std::uint8_t kMavEstimatorVio = 3;
inline constexpr std::uint8_t kMavStateCalibrating = 2, kMavStateActive = 4, kMavStateCritical = 5, kMavStateTermination = 8;
enum class MavSeverity : std::uint8_t { error = 3, warning = 4, notice = 5, info = 6 };

inline constexpr float kMavUnknown = std::numeric_limits<float>::quiet_NaN();

struct HeartbeatMessage {
  static constexpr std::uint32_t kId = 0;
  static constexpr std::uint8_t kCrcExtra = 50;
  static constexpr std::uint8_t kNoAutopilot = 8;  ///< MAV_AUTOPILOT_INVALID

  std::uint32_t custom_mode = 0;
  std::uint8_t type = 18;  ///< MAV_TYPE_ONBOARD_CONTROLLER
  std::uint8_t autopilot = kNoAutopilot;
  std::uint8_t base_mode = 0;
  std::uint8_t system_status = kMavStateActive;
  std::uint8_t mavlink_version = 3;

  template <class V>
  void wire(V&& v) {
    v(custom_mode), v(type), v(autopilot), v(base_mode), v(system_status), v(mavlink_version);
  }
};

/// A request has tc1 = 0; the answer repeats its ts1 and has the other machine's time as tc1.
struct TimesyncMessage {
  static constexpr std::uint32_t kId = 111;
  static constexpr std::uint8_t kCrcExtra = 34;

  std::int64_t tc1 = 0, ts1 = 0;  ///< ns

  template <class V>
  void wire(V&& v) {
    v(tc1), v(ts1);
  }
};

/// The flight controller's IMU in forward-right-down.
struct HighresImuMessage {
  static constexpr std::uint32_t kId = 105;
  static constexpr std::uint8_t kCrcExtra = 93;
  static constexpr std::uint16_t kAccelAndGyro = 0x3f;  ///< of fields_updated

  std::uint64_t time_usec = 0;
  std::array<float, 3> acc{};   ///< m/s^2
  std::array<float, 3> gyro{};  ///< rad/s
  std::array<float, 3> mag{};   ///< gauss
  float abs_pressure = 0, diff_pressure = 0, pressure_alt = 0, temperature = 0;
  std::uint16_t fields_updated = 0;
  std::uint8_t id = 0;  ///< of several IMUs

  template <class V>
  void wire(V&& v) {
    v(time_usec), v(acc), v(gyro), v(mag), v(abs_pressure), v(diff_pressure), v(pressure_alt), v(temperature);
    v(fields_updated), v(id);
  }
};

/// The same with a lower resolution.
struct ScaledImuMessage {
  static constexpr std::uint32_t kId = 26;
  static constexpr std::uint8_t kCrcExtra = 170;

  std::uint32_t time_boot_ms = 0;
  std::array<std::int16_t, 3> acc{};   ///< thousandths of g
  std::array<std::int16_t, 3> gyro{};  ///< mrad/s
  std::array<std::int16_t, 3> mag{};   ///< thousandths of a gauss
  std::int16_t temperature = 0;        ///< hundredths of a degree Celsius

  template <class V>
  void wire(V&& v) {
    v(time_boot_ms), v(acc), v(gyro), v(mag), v(temperature);
  }
};

struct OdometryMessage {
  static constexpr std::uint32_t kId = 331;
  static constexpr std::uint8_t kCrcExtra = 91;

  std::uint64_t time_usec = 0;
  float x = 0, y = 0, z = 0;                          ///< m, in frame_id
  std::array<float, 4> q{1, 0, 0, 0};                 ///< w first, child_frame_id to frame_id
  float vx = 0, vy = 0, vz = 0;                       ///< m/s, in child_frame_id
  float rollspeed = 0, pitchspeed = 0, yawspeed = 0;  ///< rad/s, in child_frame_id
  std::array<float, 21> pose_covariance{};            ///< x, y, z, roll, pitch, yaw: upper triangle by rows
  std::array<float, 21> velocity_covariance{};        ///< vx, vy, vz and the three rates, likewise
  std::uint8_t frame_id = kMavFrameLocalFrd, child_frame_id = kMavFrameBodyFrd;
  std::uint8_t reset_counter = 0;
  std::uint8_t estimator_type = kMavEstimatorVio;
  std::int8_t quality = 0;  ///< percent; 0: unknown, -1: failed

  template <class V>
  void wire(V&& v) {
    v(time_usec), v(x), v(y), v(z), v(q), v(vx), v(vy), v(vz), v(rollspeed), v(pitchspeed), v(yawspeed);
    v(pose_covariance), v(velocity_covariance), v(frame_id), v(child_frame_id);
    v(reset_counter), v(estimator_type), v(quality);
  }
};

struct VisionPositionMessage {
  static constexpr std::uint32_t kId = 102;
  static constexpr std::uint8_t kCrcExtra = 158;

  std::uint64_t usec = 0;
  float x = 0, y = 0, z = 0;           ///< m, local frame
  float roll = 0, pitch = 0, yaw = 0;  ///< rad
  std::array<float, 21> covariance{};  ///< as OdometryMessage::pose_covariance
  std::uint8_t reset_counter = 0;

  template <class V>
  void wire(V&& v) {
    v(usec), v(x), v(y), v(z), v(roll), v(pitch), v(yaw), v(covariance), v(reset_counter);
  }
};

struct VisionSpeedMessage {
  static constexpr std::uint32_t kId = 103;
  static constexpr std::uint8_t kCrcExtra = 208;

  std::uint64_t usec = 0;
  float x = 0, y = 0, z = 0;          ///< m/s, local frame
  std::array<float, 9> covariance{};  ///< by rows
  std::uint8_t reset_counter = 0;

  template <class V>
  void wire(V&& v) {
    v(usec), v(x), v(y), v(z), v(covariance), v(reset_counter);
  }
};

struct StatusTextMessage {
  static constexpr std::uint32_t kId = 253;
  static constexpr std::uint8_t kCrcExtra = 83;

  MavSeverity severity = MavSeverity::info;
  std::array<char, 50> text{};  ///< ends with a zero where it is shorter
  std::uint16_t id = 0;
  std::uint8_t chunk_seq = 0;

  template <class V>
  void wire(V&& v) {
    v(severity), v(text), v(id), v(chunk_seq);
  }
};

/// A sentence that is longer than the message's field is cut off.
StatusTextMessage status_text(MavSeverity severity, const std::string& sentence);

using MavlinkMessage =
    std::variant<HeartbeatMessage, TimesyncMessage, OdometryMessage, VisionPositionMessage, VisionSpeedMessage, StatusTextMessage,
                 PositionTargetMessage, CommandMessage, CommandAckMessage, LandedStateMessage, HilSensorMessage,
                 HilActuatorControlsMessage, LocalPositionMessage, AttitudeQuaternionMessage, GlobalOriginMessage,
                 KnownOriginMessage, HighresImuMessage, ScaledImuMessage, ParameterRequestMessage, ParameterValueMessage,
                 DistanceSensorMessage, OpticalFlowRadMessage, ScaledPressureMessage>;

}  // namespace fbvins
