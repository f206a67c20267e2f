// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mavlink/px4_parameters.hpp"

#include <fmt/format.h>

#include <cmath>

namespace fbvins {
namespace {

constexpr bool kReboot = true;
constexpr const char* kImuPlace[] = {"EKF2_IMU_POS_X", "EKF2_IMU_POS_Y", "EKF2_IMU_POS_Z"};
constexpr const char* kDdsPort = "UXRCE_DDS_CFG";
constexpr int kTelem2 = 102, kEthernet = 1000;  ///< ports in PX4's parameters

Px4Parameter whole(const char* name, double value, const char* why, bool reboot = false) {
  return {name, value, true, reboot, why};
}
Px4Parameter real(const char* name, double value, const char* why, bool reboot = false) {
  return {name, value, false, reboot, why};
}

void add_link(const Px4VisionSetup& setup, std::vector<Px4Parameter>& out) {
  if (setup.link == Px4Link::serial) {
    out.push_back(whole("MAV_1_CONFIG", kTelem2, "MAVLink on TELEM 2", kReboot));
    out.push_back(whole("MAV_1_MODE", 2, "messages for an onboard computer", kReboot));
    out.push_back(whole("MAV_1_FLOW_CTRL", 0, "nothing is sent where flow control waits for wires that are not there", kReboot));
    out.push_back(whole("SER_TEL2_BAUD", 921600, "50 poses a second take 12 kB/s", kReboot));
  } else if (setup.link == Px4Link::ethernet) {
    out.push_back(whole("MAV_2_CONFIG", kEthernet, "MAVLink on Ethernet", kReboot));
    out.push_back(whole("MAV_2_MODE", 2, "messages for an onboard computer", kReboot));
    out.push_back(whole("MAV_2_UDP_PRT", 14550, "the port of --mavlink udp:HOST:14550", kReboot));
    out.push_back(whole("MAV_2_REMOTE_PRT", 14540, "the own port of --mavlink", kReboot));
  }
}

bool fits(const Px4Parameter& p, double value) {
  const double tolerance = p.whole ? 0 : 1e-5 * std::max(1.0, std::abs(p.value));
  if (p.at_least && value >= p.value - tolerance) return true;
  if (p.at_most && value <= p.value + tolerance) return true;
  return std::abs(value - p.value) <= tolerance;
}

std::string number(const Px4Parameter& p, double value) {
  return p.whole ? fmt::format("{:.0f}", value) : fmt::format("{:g}", value);
}

}  // namespace

std::vector<Px4Parameter> px4_parameters(const Px4VisionSetup& setup) {
  std::vector<Px4Parameter> out = {
      whole("EKF2_EV_CTRL", 15, "position, height, velocity and yaw from vision"),
      whole("EKF2_HGT_REF", 3, "height from vision"),
      whole("EKF2_GPS_CTRL", setup.gps ? 7 : 0,
            setup.gps ? "position, height and velocity from GPS beside vision"
                      : "beside GPS the heading of a frame that is not north-aligned is not fused"),
      whole("EKF2_BARO_CTRL", setup.barometer ? 1 : 0,
            setup.barometer ? "a height for when vision fails: Altitude mode and landing need it"
                            : "without a barometer a loss of vision is a loss of the height, too"),
  };
  if (!setup.compass) {
    out.push_back(whole("EKF2_MAG_TYPE", 5, "heading from vision alone", kReboot));
    out.push_back(whole("SYS_HAS_MAG", 0, "else PX4 waits for a compass before it arms: \"Found 0 compass\"", kReboot));
  }
  out.push_back(real("EKF2_EV_DELAY", 0, "stamps are on its clock", kReboot));
  out.push_back(whole("EKF2_EV_NOISE_MD", 0, "the covariance that is sent is used"));
  out.push_back(whole("EKF2_EV_QMIN", 1, "poses of unknown or failed quality are not fused"));
  out.push_back(
      real("EKF2_EVA_NOISE", 0.05, "v1.17 takes this angle for a variance: a larger one leaves vision yaw little weight"));
  out.back().at_most = true;
  out.push_back(real("EKF2_DELAY_MAX", 200, "how long a pose may be under way [ms]", kReboot));
  out.back().at_least = true;
  for (const char* name : {"EKF2_EV_POS_X", "EKF2_EV_POS_Y", "EKF2_EV_POS_Z"})
    out.push_back(real(name, 0, "the place of the IMU is in live.mavlink.mounting"));
  if (!setup.gps) {
    out.push_back(whole("EKF2_NOAID_TOUT", 1000000, "how long it flies on blind before Position mode ends [us]"));
    out.back().at_most = true;
  }
  out.push_back(whole("MAV_SYS_ID", setup.system_id, "live.mavlink.system_id names the same vehicle", kReboot));
  add_link(setup, out);
  return out;
}

std::string px4_parameter_file(const Px4VisionSetup& setup) {
  std::string text =
      "# Parameters of PX4 (v1.14 and later) for the poses of fbvins live --mavlink; docs/px4.md says why.\n"
      "# Restart the flight controller after loading them.\n"
      "# Vehicle-Id Component-Id Name Value Type\n";
  for (const Px4Parameter& p : px4_parameters(setup))
    text += fmt::format("{}\t1\t{}\t{}\t{}\n", setup.system_id, p.name,
                        p.whole ? fmt::format("{:.0f}", p.value) : fmt::format("{:.6f}", p.value), p.whole ? 6 : 9);
  return text;
}

std::vector<std::string> px4_parameter_names(const Px4VisionSetup& setup) {
  std::vector<std::string> out;
  for (const Px4Parameter& p : px4_parameters(setup)) out.push_back(p.name);
  for (const char* name : kImuPlace) out.emplace_back(name);
  if (setup.link == Px4Link::serial) out.emplace_back(kDdsPort);
  return out;
}

std::vector<Px4Finding> judge_px4(const Px4VisionSetup& setup, const std::map<std::string, double>& values) {
  std::vector<Px4Finding> out;
  for (const Px4Parameter& p : px4_parameters(setup)) {
    const auto found = values.find(p.name);
    if (found == values.end()) {
      out.push_back(
          {true, p.name, fmt::format("{} is not answered: is this PX4 older than v1.14, or built without it?", p.name)});
    } else if (!fits(p, found->second)) {
      const char* bound = p.at_least ? "at least " : p.at_most ? "at most " : "";
      out.push_back(
          {true, p.name,
           fmt::format("{} is {}, and should be {}{}: {}{}", p.name, number(p, found->second), bound, number(p, p.value), p.why,
                       p.reboot ? " (restart the flight controller after the change)" : "")});
    }
  }
  if (const auto dds = values.find(kDdsPort); setup.link == Px4Link::serial && dds != values.end() && dds->second == kTelem2)
    out.push_back(
        {true, kDdsPort,
         fmt::format("{} is {}: uXRCE-DDS has TELEM 2, too; 0, or another port (restart the flight controller after the "
                     "change)",
                     kDdsPort, kTelem2)});
  for (const char* name : kImuPlace)
    if (const auto found = values.find(name); found != values.end() && found->second != 0)
      out.push_back(
          {false, name,
           fmt::format(
               "{} is {:g} m: live.mavlink.mounting counts from the vehicle's origin then, not from the flight controller", name,
               found->second)});
  return out;
}

}  // namespace fbvins
