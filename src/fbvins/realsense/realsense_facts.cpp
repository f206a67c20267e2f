// SPDX-License-Identifier: Apache-2.0
// What a RealSense camera says of itself: realsense_facts(), is_calibrated().

#include "fbvins/realsense/realsense_camera.hpp"

namespace fbvins {
namespace {

std::string info_of(const rs2::device& device, rs2_camera_info which) {
  return device.supports(which) ? device.get_info(which) : "";
}

std::string emitter_of(const rs2::sensor& stereo, const RealsenseSeen& seen) {
  if (seen.emitter_on && seen.emitter_off) return "alternating";
  if (seen.emitter_on) return "on";
  if (seen.emitter_off) return "off";
  if (!stereo.supports(RS2_OPTION_EMITTER_ENABLED)) return "unknown";
  return stereo.get_option(RS2_OPTION_EMITTER_ENABLED) == 0 ? "off" : "on";
}

/// A fixed exposure, or the limit of the automatic one.
std::optional<double> longest_exposure_ms(const rs2::sensor& stereo) {
  const auto is_on = [&](rs2_option option) { return !stereo.supports(option) || stereo.get_option(option) != 0; };
  if (!is_on(RS2_OPTION_ENABLE_AUTO_EXPOSURE) && stereo.supports(RS2_OPTION_EXPOSURE))
    return 1e-3 * static_cast<double>(stereo.get_option(RS2_OPTION_EXPOSURE));
  if (stereo.supports(RS2_OPTION_AUTO_EXPOSURE_LIMIT) && is_on(RS2_OPTION_AUTO_EXPOSURE_LIMIT_TOGGLE))
    return 1e-3 * static_cast<double>(stereo.get_option(RS2_OPTION_AUTO_EXPOSURE_LIMIT));
  return std::nullopt;
}

/// Of scale and bias: those of an IMU without a calibration, or nothing.
bool is_nothing(const rs2_motion_device_intrinsic& motion) {
  bool identity = true, zero = true;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) {
      identity &= motion.data[row][column] == (row == column ? 1.0f : 0.0f);
      zero &= motion.data[row][column] == 0;
    }
  return identity || zero;
}

}  // namespace

DeviceFacts realsense_facts(const rs2::device& device, const rs2::sensor& stereo, const RealsenseSeen& seen) {
  DeviceFacts facts;
  facts.model = info_of(device, RS2_CAMERA_INFO_NAME);
  facts.firmware = info_of(device, RS2_CAMERA_INFO_FIRMWARE_VERSION);
  facts.recommended_firmware = info_of(device, RS2_CAMERA_INFO_RECOMMENDED_FIRMWARE_VERSION);
  facts.usb = info_of(device, RS2_CAMERA_INFO_USB_TYPE_DESCRIPTOR);
  // A file of sysfs for the kernel's driver, numbers of bus and port for the library's own.
  const std::string port = info_of(device, RS2_CAMERA_INFO_PHYSICAL_PORT);
  if (!port.empty()) facts.driver = port.front() == '/' ? "kernel" : "user space";
  if (seen.clock == RS2_TIMESTAMP_DOMAIN_GLOBAL_TIME) facts.clock = "global";
  if (seen.clock == RS2_TIMESTAMP_DOMAIN_HARDWARE_CLOCK) facts.clock = "device";
  if (seen.clock == RS2_TIMESTAMP_DOMAIN_SYSTEM_TIME) facts.clock = "arrival";
  facts.exposure_ms = seen.exposure_ms;
  facts.emitter = emitter_of(stereo, seen);
  facts.longest_exposure_ms = longest_exposure_ms(stereo);
  return facts;
}

bool is_calibrated(const rs2::motion_stream_profile& gyro, const rs2::motion_stream_profile& accel) {
  try {
    return !is_nothing(gyro.get_motion_intrinsics()) || !is_nothing(accel.get_motion_intrinsics());
  } catch (const rs2::error&) {  // the device has none
    return false;
  }
}

}  // namespace fbvins
