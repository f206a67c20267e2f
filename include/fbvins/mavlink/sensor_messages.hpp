// SPDX-License-Identifier: Apache-2.0
// The MAVLink messages of a flight controller's sensors that aid images and IMU. Fields, names and units are those of the
// protocol's common set, as in messages.hpp.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

namespace fbvins {

struct DistanceSensorMessage {
  static constexpr std::uint32_t kId = 132;
  static constexpr std::uint8_t kCrcExtra = 85;
  static constexpr std::uint8_t kDown = 25, kCustom = 100;  ///< of orientation: MAV_SENSOR_ROTATION_PITCH_270, ..._CUSTOM
  static constexpr std::uint8_t kUnknownVariance = 255, kInvalid = 1;

  std::uint32_t time_boot_ms = 0;
  std::uint16_t min_distance = 0, max_distance = 0, current_distance = 0;  ///< cm
  std::uint8_t type = 0, id = 0, orientation = kDown;
  std::uint8_t covariance = kUnknownVariance;  ///< cm^2
  float horizontal_fov = 0, vertical_fov = 0;  ///< rad
  std::array<float, 4> quaternion{};           ///< w first; of the orientation kCustom, sensor to vehicle
  std::uint8_t signal_quality = 0;             ///< percent; 0: not known, 1: the reading is invalid

  template <class V>
  void wire(V&& v) {
    v(time_boot_ms), v(min_distance), v(max_distance), v(current_distance), v(type), v(id), v(orientation), v(covariance);
    v(horizontal_fov), v(vertical_fov), v(quaternion), v(signal_quality);
  }
};

/// Optical flow, integrated; of a sensor that looks down, in forward-right-down.
struct OpticalFlowRadMessage {
  static constexpr std::uint32_t kId = 106;
  static constexpr std::uint8_t kCrcExtra = 138;

  std::uint64_t time_usec = 0;
  std::uint32_t integration_time_us = 0;
  float integrated_x = 0, integrated_y = 0;                                ///< rad about the axes, the turn's part included
  float integrated_xgyro = 0, integrated_ygyro = 0, integrated_zgyro = 0;  ///< rad
  std::uint32_t time_delta_distance_us = 0;
  float distance = -1;           ///< m, to the centre of the flow; negative: not known
  std::int16_t temperature = 0;  ///< hundredths of a degree Celsius
  std::uint8_t sensor_id = 0;
  std::uint8_t quality = 0;  ///< 0: no flow; 255: the best

  template <class V>
  void wire(V&& v) {
    v(time_usec), v(integration_time_us), v(integrated_x), v(integrated_y), v(integrated_xgyro), v(integrated_ygyro);
    v(integrated_zgyro), v(time_delta_distance_us), v(distance), v(temperature), v(sensor_id), v(quality);
  }
};

struct ScaledPressureMessage {
  static constexpr std::uint32_t kId = 29;
  static constexpr std::uint8_t kCrcExtra = 115;

  std::uint32_t time_boot_ms = 0;
  float press_abs = 0, press_diff = 0;  ///< hPa
  std::int16_t temperature = 0, temperature_press_diff = 0;

  template <class V>
  void wire(V&& v) {
    v(time_boot_ms), v(press_abs), v(press_diff), v(temperature), v(temperature_press_diff);
  }
};

}  // namespace fbvins
