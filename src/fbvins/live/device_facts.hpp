// SPDX-License-Identifier: Apache-2.0
// What a camera with an IMU says of itself, and what to do about it before a first flight (docs/d435i.md). Devices of this
// program fill DeviceFacts; a bridge sends them as text over the socket (FbvinsSocketDevice).
//
//   const auto facts = parse_device_facts("firmware=5.13.0\nusb=2.1\n");
//   for (const SensorFinding& finding : device_findings(*facts, rig)) ...
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/live/source.hpp"

namespace fbvins {

/// What is empty is not known, and nothing is said of it.
struct DeviceFacts {
  std::string model;
  std::string firmware, recommended_firmware;  ///< numbers with dots between
  std::string usb;                             ///< version, such as "3.2"
  std::string driver;                          ///< "kernel", "user space"
  std::string clock;                           ///< of stamps: "global", "device", "arrival"
  std::string emitter;                         ///< of the dot projector: "off", "on", "alternating", "unknown"
  std::string mode, other_modes;               ///< "640x480@30"; those that the device offers as well
  std::string set_mode;                        ///< how to choose one, such as "--source d435i:MODE"
  std::optional<double> exposure_ms;           ///< of the newest image
  std::optional<double> longest_exposure_ms;   ///< that automatic exposure may take, or the fixed one
  std::optional<bool> imu_calibrated;          ///< scale, axes and biases are the device's own
  std::optional<int> resets, stalls;           ///< of the USB device, and of its streams while it was there
};

/// KEY=VALUE in each line, with the keys of the struct's fields; those of later versions are left. An error names the line.
Result<DeviceFacts> parse_device_facts(std::string_view text);

/// One sentence of each known fact.
std::vector<SensorFinding> device_findings(const DeviceFacts& facts, const StereoRig& rig);

/// Pixels that the middle of the image moves in an exposure while the camera turns by one radian a second.
double blur_px(const Camera& camera, double exposure_ms);

/// That automatic exposure is limited to, where a device has such a limit: about 3 px of blur with its lens.
inline constexpr double kLongestExposure_ms = 8;

}  // namespace fbvins
