// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/px4_controller.hpp"

#include <cmath>

#include "fbvins/flight/px4_mission.hpp"

namespace fbvins {
namespace {

/// PX4 uses its estimate of the companion's clock offset after 500 TIMESYNC answers, at 10 Hz.
constexpr double kPx4WarmUp_s = 56;
/// PX4's clock at the beginning of the warm-up.
constexpr double kPx4Boot_s = 1;

MavlinkOptions px4_options(int system_id, const Pose<BodyFlu, B>& mounting, bool in_map) {
  MavlinkOptions options;
  options.system_id = system_id;
  options.rate_hz = kCompanionRate_hz;
  // PX4 since February 2026 does not arm with local_frd. There is no GPS or magnetometer with another heading.
  options.frame = MavlinkFrameId::local_ned;
  options.mounting = mounting_options_of(mounting, in_map);
  return options;
}

}  // namespace

Result<std::unique_ptr<FlightController>> Px4Controller::create(const ControllerProgram& program, const Mission& mission,
                                                                const ControlOptions& control, const QuadrotorOptions& vehicle,
                                                                const StereoRig& rig, const Pose<BodyFlu, B>& mounting) {
  Result<std::unique_ptr<Px4Process>> px4 = Px4Process::start(program.binary, program.folder, px4_parameters(control, vehicle));
  if (!px4) return px4.error();
  const Link link{UdpAddress{"127.0.0.1", (*px4)->companion_port(), 0},
                  px4_options((*px4)->system_id(), mounting, program.in_map), kPx4WarmUp_s, kPx4WarmUp_s + kPx4Boot_s};
  std::unique_ptr<Px4Controller> controller(new Px4Controller(*std::move(px4), link, mission, rig));
  if (Result<void> done = controller->open(program.folder); !done) return done.error();
  return std::unique_ptr<FlightController>(std::move(controller));
}

Px4Controller::Px4Controller(std::unique_ptr<Px4Process> px4, const Link& link, const Mission& mission, const StereoRig& rig)
    : CompanionController(
          link, std::make_unique<Px4Mission>(mission, rig.imu_noise.rate_hz, link.options.system_id, link.ahead_s), rig),
      px4_(std::move(px4)) {}

Result<void> Px4Controller::step(const BoardReading& reading, double t_s) {
  HilSensorMessage message = sensor_message(reading, static_cast<std::uint64_t>(std::llround(1e6 * t_s)));
  if (height_m_) add_height(message, *height_m_);
  if (Result<void> done = px4_->step(message); !done) return done;
  for (std::size_t i = 0; i < kRotors; ++i) commands_[i] = static_cast<double>(px4_->controls()[i]);
  return {};
}

}  // namespace fbvins
