// SPDX-License-Identifier: Apache-2.0
// Prints what the MAVLink sink sends to a flight controller. Time, poses and the flight controller's bytes come from the standard
// input, so a test can run it in simulated time. Arguments: options name=value, as of `fbvins live --set`. Lines of the input:
//   pose HOST_NS STATE RESETS P(3) Q_WXYZ(4) V(3) W(3) SIGMA_P SIGMA_THETA SIGMA_V     at an IMU reading
//   health HOST_NS STATE                                                               when it changes
//   bytes HOST_NS HEXADECIMAL                                                          from the flight controller
//   tick HOST_NS
// The answer to each is the frames to send, each a line in hexadecimal, then ".". STATE: good, degraded, lost or initialising.
#include <fmt/format.h>

#include <iostream>
#include <sstream>
#include <string>

#include "fbvins/config/config_file.hpp"
#include "fbvins/live/mavlink_session.hpp"

namespace fbvins {
namespace {

Health read_health(std::istream& in) {
  std::string state;
  in >> state;
  for (const HealthState one : {HealthState::good, HealthState::degraded, HealthState::lost})
    if (state == to_string(one)) return {one, one == HealthState::good ? HealthReason::none : HealthReason::no_images};
  return {HealthState::initialising, HealthReason::waiting_for_motion_or_rest};
}

Vec3 read_vector(std::istream& in) {
  Vec3 v;
  in >> v.x() >> v.y() >> v.z();
  return v;
}

LivePose read_pose(std::istream& in, Time now) {
  LivePose pose;
  pose.t = pose.host_t = now;
  pose.health = read_health(in);
  in >> pose.reset_counter;
  pose.T_WB.p = read_vector(in);
  in >> pose.T_WB.q.w() >> pose.T_WB.q.x() >> pose.T_WB.q.y() >> pose.T_WB.q.z();
  pose.v_WB = read_vector(in), pose.w_WB_B = read_vector(in);
  const Vec3 sigmas = read_vector(in);
  pose.pose_covariance.diagonal() << Vec3::Constant(sigmas[0] * sigmas[0]), Vec3::Constant(sigmas[1] * sigmas[1]);
  pose.velocity_covariance = Mat3::Identity() * sigmas[2] * sigmas[2];
  return pose;
}

std::vector<std::uint8_t> read_bytes(std::istream& in) {
  std::string text;
  in >> text;
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  return bytes;
}

MavlinkSession::Frames answer(MavlinkSession& session, const std::string& line) {
  std::istringstream in(line);
  std::string what;
  Time now;
  in >> what >> now.ns;
  if (what == "pose") return session.take(read_pose(in, now));
  if (what == "bytes") return session.receive(read_bytes(in), now);
  if (what == "tick") return session.tick(now);
  LiveStatus status;
  status.health = read_health(in);
  return session.take(status, now);
}

}  // namespace
}  // namespace fbvins

int main(int argc, char** argv) {
  const auto config = fbvins::load_config("", {argv + 1, argv + argc});
  if (!config) return fmt::print(stderr, "{}\n", config.error().message), 2;
  fbvins::MavlinkSession session(config->live.mavlink);
  for (std::string line; std::getline(std::cin, line);) {
    for (const auto& frame : fbvins::answer(session, line)) {
      for (const std::uint8_t byte : frame) fmt::print("{:02x}", byte);
      fmt::print("\n");
    }
    fmt::print(".\n");
    std::fflush(stdout);
  }
}
