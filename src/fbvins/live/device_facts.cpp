// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/device_facts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

constexpr double kMostBlur_px = 4;
constexpr double kOldUsb = 3;  // versions below are too slow for two cameras at their full rate

std::optional<double> number_of(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != 0 || !std::isfinite(value) || value < 0 || value > 1e6) return std::nullopt;
  return value;
}

std::optional<bool> yes_or_no(const std::string& text) {
  if (text == "yes") return true;
  if (text == "no") return false;
  return std::nullopt;
}

std::optional<int> count_of(const std::string& text) {
  const auto number = number_of(text);
  return number && *number == std::floor(*number) ? std::optional(static_cast<int>(*number)) : std::nullopt;
}

/// False: the value is none for this key. Keys of later versions are taken as they are.
bool put_fact(DeviceFacts& facts, std::string_view key, const std::string& value) {
  const std::pair<std::string_view, std::string*> words[] = {
      {"model", &facts.model},      {"firmware", &facts.firmware}, {"recommended_firmware", &facts.recommended_firmware},
      {"usb", &facts.usb},          {"driver", &facts.driver},     {"clock", &facts.clock},
      {"emitter", &facts.emitter},  {"mode", &facts.mode},         {"other_modes", &facts.other_modes},
      {"set_mode", &facts.set_mode}};
  for (const auto& [name, field] : words)
    if (name == key) *field = value;
  const auto put = [&](std::string_view name, auto& field, auto parsed) {
    if (name == key) field = parsed;
    return name != key || parsed.has_value();
  };
  return put("exposure_ms", facts.exposure_ms, number_of(value)) &&
         put("longest_exposure_ms", facts.longest_exposure_ms, number_of(value)) &&
         put("imu_calibrated", facts.imu_calibrated, yes_or_no(value)) && put("resets", facts.resets, count_of(value)) &&
         put("stalls", facts.stalls, count_of(value));
}

std::vector<long> parts_of(const std::string& version) {
  std::vector<long> parts;
  for (const char* at = version.c_str(); *at != 0;) {
    char* end = nullptr;
    const long part = std::strtol(at, &end, 10);
    if (end == at) break;
    parts.push_back(part);
    at = *end == '.' ? end + 1 : "";
  }
  return parts;
}

bool is_older(const std::string& version, const std::string& other) {
  const auto a = parts_of(version), b = parts_of(other);
  return !a.empty() && !b.empty() && std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
}

using Findings = std::vector<SensorFinding>;

SensorFinding good(std::string text) { return {true, std::move(text)}; }
SensorFinding advice(std::string text) { return {true, std::move(text), true}; }
SensorFinding wrong(std::string text) { return {false, std::move(text)}; }

void judge_firmware(const DeviceFacts& facts, Findings& findings) {
  if (facts.firmware.empty()) return;
  const std::string what = fmt::format("{}firmware {}", facts.model.empty() ? "" : facts.model + ", ", facts.firmware);
  if (is_older(facts.firmware, facts.recommended_firmware))
    findings.push_back(advice(
        fmt::format("{}, and its library recommends {}; update it by the maker's program", what, facts.recommended_firmware)));
  else findings.push_back(good(what));
}

void judge_cable(const DeviceFacts& facts, Findings& findings) {
  if (const auto usb = number_of(facts.usb)) {
    if (*usb < kOldUsb)
      findings.push_back(wrong(fmt::format(
          "USB {}: too slow for both cameras; use a port and a cable of USB 3, and push the plug in quickly", facts.usb)));
    else findings.push_back(good("USB " + facts.usb));
  }
  if (facts.driver == "kernel" || facts.driver == "user space")
    findings.push_back(good(facts.driver == "kernel" ? "driver: the kernel's" : "driver: in user space (RSUSB)"));
  if (facts.clock == "arrival")
    findings.push_back(
        wrong("images are stamped when they arrive, because the kernel's driver passes no stamps of the device on; "
              "use a library in user space (RSUSB: pyrealsense2 has it), or the kernel with its maker's patches"));
  else if (facts.clock == "device")
    findings.push_back(advice("stamps are on the device's own clock; its library can also give this machine's (global time)"));
  else if (facts.clock == "global") findings.push_back(good("stamps of images and readings are on one clock (global time)"));
}

void judge_emitter(const DeviceFacts& facts, Findings& findings) {
  if (facts.emitter == "off") findings.push_back(good("the dot projector is off"));
  else if (facts.emitter == "on" || facts.emitter == "alternating")
    findings.push_back(
        wrong(fmt::format("the dot projector is {}, and its dots move with the camera; switch it off, or mask it "
                          "(opaque tape on its window)",
                          facts.emitter == "on" ? "on" : "on in every second image")));
  else if (facts.emitter == "unknown")
    findings.push_back(
        advice("the dot projector cannot be switched or read; look whether it shines (a phone's camera sees it), "
               "and mask it where it does"));
}

void judge_exposure(const DeviceFacts& facts, const StereoRig& rig, Findings& findings) {
  const double longest = facts.longest_exposure_ms.value_or(rig.image_rate_hz > 0 ? 1e3 / rig.image_rate_hz : 0);
  if (!facts.exposure_ms && !facts.longest_exposure_ms) return;
  const std::string now = facts.exposure_ms ? fmt::format("exposure {:.1f} ms, ", *facts.exposure_ms) : "exposure ";
  const double blur = blur_px(rig.left(), longest);
  const std::string what =
      fmt::format("{}at most {:.1f} ms, which is a blur of {:.1f} px while the camera turns by 1 rad/s", now, longest, blur);
  if (blur <= kMostBlur_px) findings.push_back(good(what));
  else
    findings.push_back(
        wrong(fmt::format("{}; limit it to {:.0f} ms, or set a fixed one and more light", what, longest * kMostBlur_px / blur)));
}

void judge_imu(const DeviceFacts& facts, const StereoRig& rig, Findings& findings) {
  if (facts.imu_calibrated)
    findings.push_back(*facts.imu_calibrated
                           ? good("the IMU has a calibration on the device")
                           : advice("the IMU has no calibration on the device, as it is delivered: its scale is taken as 1, its "
                                    "biases are estimated; `fbvins calibrate`, or its maker's program, improves it"));
  if (rig.time_offset_s == 0)
    findings.push_back(advice("the time offset between images and IMU is taken as 0; `fbvins calibrate` measures it"));
  else findings.push_back(good(fmt::format("the time offset between images and IMU is {:.2f} ms", 1e3 * rig.time_offset_s)));
}

void judge_mode(const DeviceFacts& facts, Findings& findings) {
  if (facts.mode.empty()) return;
  if (facts.other_modes.empty()) findings.push_back(good("images of " + facts.mode));
  else
    findings.push_back(good(fmt::format("images of {}; the device also has {}{}", facts.mode, facts.other_modes,
                                        facts.set_mode.empty() ? "" : " (" + facts.set_mode + ")")));
}

void judge_interruptions(const DeviceFacts& facts, Findings& findings) {
  if (!facts.resets && !facts.stalls) return;
  const int resets = facts.resets.value_or(0), stalls = facts.stalls.value_or(0);
  if (resets + stalls == 0) return findings.push_back(good("no reset of the USB device and no stall of its streams"));
  findings.push_back(
      wrong(fmt::format("{} resets of the USB device, {} stalls of its streams; use a short cable that is screwed on, "
                        "a port without a hub, and see `dmesg` for power",
                        resets, stalls)));
}

}  // namespace

Result<DeviceFacts> parse_device_facts(std::string_view text) {
  DeviceFacts facts;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty()) continue;
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos ||
        !put_fact(facts, line.substr(0, equals), printable(std::string(line.substr(equals + 1)))))
      return Error{ErrorCode::malformed, fmt::format("device, line {}: {}", number, quoted(line))};
  }
  return facts;
}

double blur_px(const Camera& camera, double exposure_ms) { return 1e-3 * exposure_ms * camera.focal_px(); }

std::vector<SensorFinding> device_findings(const DeviceFacts& facts, const StereoRig& rig) {
  Findings findings;
  judge_firmware(facts, findings);
  judge_cable(facts, findings);
  judge_mode(facts, findings);
  judge_emitter(facts, findings);
  judge_exposure(facts, rig, findings);
  judge_imu(facts, rig, findings);
  judge_interruptions(facts, findings);
  return findings;
}

}  // namespace fbvins
