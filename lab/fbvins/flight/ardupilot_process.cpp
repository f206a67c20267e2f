// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/ardupilot_process.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>

#include "fbvins/core/atomic_file.hpp"
#include "fbvins/flight/px4_frames.hpp"

namespace fbvins {
namespace {

/// In wall time. It starts within a second; its main loop may be slowed down by others.
constexpr int kPulses_ms = 20'000;
/// Of the packet with the servos' pulses in us: magic number, rate, count, then one for each of 16 outputs.
constexpr std::size_t kPulsesAt = 8, kPulsesSize = 40;
constexpr std::uint16_t kMagic = 18458;
constexpr double kShortest_us = 1000, kLongest_us = 2000;

/// Settings that differ from ArduPilot's defaults for every vehicle.
const ArduPilotParameters& fixed_ardupilot_parameters() {
  static const ArduPilotParameters parameters{
      {"FRAME_CLASS", "1"},
      {"FRAME_TYPE", "1"},
      {"SCHED_LOOP_RATE", "250"},
      // docs/px4.md: vision is the only source of position and heading; the second set of sources is for when it fails.
      {"AHRS_EKF_TYPE", "3"},
      {"EK2_ENABLE", "0"},
      {"EK3_ENABLE", "1"},
      {"EK3_IMU_MASK", "1"},
      {"EK3_SRC1_POSXY", "6"},
      {"EK3_SRC1_VELXY", "6"},
      {"EK3_SRC1_POSZ", "6"},
      {"EK3_SRC1_VELZ", "6"},
      {"EK3_SRC1_YAW", "6"},
      {"EK3_SRC2_POSXY", "0"},
      {"EK3_SRC2_VELXY", "0"},
      {"EK3_SRC2_POSZ", "1"},
      {"EK3_SRC2_VELZ", "0"},
      {"EK3_SRC2_YAW", "0"},
      {"VISO_TYPE", "1"},
      {"VISO_QUAL_MIN", "1"},
      {"VISO_DELAY_MS", "10"},
      {"VISO_POS_M_NSE", "0.1"},
      {"VISO_VEL_M_NSE", "0.1"},
      {"VISO_YAW_M_NSE", "0.05"},
      {"GPS1_TYPE", "0"},
      {"COMPASS_ENABLE", "0"},
      // No remote control, no ground station, no battery monitor, no log.
      {"FS_THR_ENABLE", "0"},
      {"FS_GCS_ENABLE", "0"},
      {"BATT_MONITOR", "0"},
      {"LOG_BACKEND_TYPE", "0"},
      // The errors of the IMU and of the barometer are those that it is sent.
      {"INS_GYR_CAL", "0"},
      {"SIM_GPS1_ENABLE", "0"},
      {"SIM_BARO_RND", "0"},
      {"SIM_BARO_DRIFT", "0"},
      {"SIM_ACC1_RND", "0"},
      {"SIM_GYR1_RND", "0"},
  };
  return parameters;
}

Result<void> write_parameters(const ArduPilotParameters& parameters, const std::string& path) {
  std::string text;
  for (const auto& [name, value] : parameters) text += fmt::format("{} {}\n", name, value);
  return write_file_atomically(path, text);
}

}  // namespace

ArduPilotParameters ardupilot_parameters(const QuadrotorOptions& vehicle) {
  ArduPilotParameters parameters = fixed_ardupilot_parameters();
  const double full_N = kRotors * vehicle.thrust_N_per_radps2 * vehicle.rotor_max_radps * vehicle.rotor_max_radps;
  const double hover = vehicle.mass_kg * 9.81 / full_N;
  parameters.emplace_back("MOT_THST_EXPO", vehicle.command_is_thrust ? "0" : "1");
  parameters.emplace_back("MOT_THST_HOVER", fmt::format("{:.3f}", std::clamp(hover, 0.125, 0.6875)));
  parameters.emplace_back("MOT_PWM_MIN", "1000");
  parameters.emplace_back("MOT_PWM_MAX", "2000");
  return parameters;
}

Result<std::unique_ptr<ArduPilotProcess>> ArduPilotProcess::start(const std::string& binary, const std::string& folder,
                                                                  const ArduPilotParameters& parameters) {
  std::error_code missing;
  const std::string program = std::filesystem::canonical(binary, missing).string();
  if (missing || access(program.c_str(), X_OK) != 0)
    return Error{ErrorCode::invalid_argument, fmt::format("{}: there is no ArduPilot executable", binary)};
  std::unique_ptr<ArduPilotProcess> ardupilot(new ArduPilotProcess(std::filesystem::absolute(folder).string()));
  if (Result<void> done = ardupilot->launch(program, parameters); !done) return done.error();
  return ardupilot;
}

Result<void> ArduPilotProcess::launch(const std::string& binary, const ArduPilotParameters& parameters) {
  simulator_ = bound_to_loopback(SOCK_DGRAM, 0);
  companion_port_ = port_of(bound_to_loopback(SOCK_DGRAM, 0));
  if (!simulator_ || companion_port_ == 0) return Error{ErrorCode::unreadable, "no UDP port is free"};
  const std::string file = folder_ + "/fbvins.parm";
  if (Result<void> done = write_parameters(parameters, file); !done) return done;
  if (Result<void> done = child_.start({{binary,
                                         "--model",
                                         "JSON:127.0.0.1",
                                         "--sim-port-out",
                                         std::to_string(port_of(simulator_)),
                                         "--serial0",
                                         fmt::format("udpclient:127.0.0.1:{}", companion_port_),
                                         "--serial1",
                                         "none",
                                         "--serial2",
                                         "none",
                                         "--rc-in-port",
                                         "0",
                                         "--irlock-port",
                                         "0",
                                         "--home",
                                         "47.4,8.5,400,0",
                                         "--defaults",
                                         file,
                                         "--wipe"},
                                        environment_without("SITL_"),
                                        folder_,
                                        folder_ + "/ardupilot.log"});
      !done)
    return done;
  return take_pulses();
}

Result<void> ArduPilotProcess::take_pulses() {
  std::array<unsigned char, 256> packet{};
  socklen_t size = sizeof peer_;
  ssize_t got = -1;
  if (readable(simulator_.number(), kPulses_ms))
    got = recvfrom(simulator_.number(), packet.data(), packet.size(), 0, reinterpret_cast<sockaddr*>(&peer_), &size);
  std::uint16_t magic = 0;
  std::memcpy(&magic, packet.data(), sizeof magic);
  if (got < static_cast<ssize_t>(kPulsesSize) || magic != kMagic)
    return Error{ErrorCode::unreadable,
                 fmt::format("ArduPilot does not answer any more; its output is in {}/ardupilot.log", folder_)};
  std::array<std::uint16_t, kRotors> pulses_us{};
  std::memcpy(pulses_us.data(), packet.data() + kPulsesAt, sizeof pulses_us);
  for (std::size_t i = 0; i < kRotors; ++i)
    commands_[i] = std::clamp((pulses_us[i] - kShortest_us) / (kLongest_us - kShortest_us), 0.0, 1.0);
  return {};
}

/// Attitude and velocity are required fields of the interface. They serve sensors that it does not have here.
Result<void> ArduPilotProcess::step(double t_s, const BoardReading& reading, double height_m) {
  const Vec3 w = flu_to_frd(reading.gyro), a = flu_to_frd(reading.accel);
  const std::string data = fmt::format(
      "\n{{\"timestamp\":{:.6f},\"imu\":{{\"gyro\":[{:.7f},{:.7f},{:.7f}],\"accel_body\":[{:.6f},{:.6f},{:.6f}]}},"
      "\"position\":[0,0,{:.5f}],\"quaternion\":[1,0,0,0],\"velocity\":[0,0,0],\"no_time_sync\":1}}\n",
      t_s, w.x(), w.y(), w.z(), a.x(), a.y(), a.z(), -height_m);
  if (sendto(simulator_.number(), data.data(), data.size(), 0, reinterpret_cast<const sockaddr*>(&peer_), sizeof peer_) < 0)
    return Error{ErrorCode::unreadable, "the sensor data could not be sent to ArduPilot"};
  return take_pulses();
}

}  // namespace fbvins
