// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/ardupilot_controller.hpp"

#include "fbvins/flight/ardupilot_mission.hpp"

namespace fbvins {
namespace {

/// It calibrates its sensors and levels itself.
constexpr double kArduPilotWarmUp_s = 20;

MavlinkOptions ardupilot_options(const Pose<BodyFlu, B>& mounting, bool in_map) {
  MavlinkOptions options;
  options.system_id = ArduPilotProcess::kSystemId;
  options.rate_hz = kCompanionRate_hz;
  options.dialect = MavlinkDialect::ardupilot;
  options.mounting = mounting_options_of(mounting, in_map);
  return options;
}

}  // namespace

Result<std::unique_ptr<FlightController>> ArduPilotController::create(const ControllerProgram& program, const Mission& mission,
                                                                      const QuadrotorOptions& vehicle, const StereoRig& rig,
                                                                      const Pose<BodyFlu, B>& mounting) {
  Result<std::unique_ptr<ArduPilotProcess>> ardupilot =
      ArduPilotProcess::start(program.binary, program.folder, ardupilot_parameters(vehicle));
  if (!ardupilot) return ardupilot.error();
  // It sends from a port that only its first packet tells.
  const std::uint16_t port = (*ardupilot)->companion_port();
  const Link link{UdpAddress{"127.0.0.1", port, port, true}, ardupilot_options(mounting, program.in_map), kArduPilotWarmUp_s,
                  kArduPilotWarmUp_s};
  std::unique_ptr<ArduPilotController> controller(new ArduPilotController(*std::move(ardupilot), link, mission, rig));
  if (Result<void> done = controller->open(program.folder); !done) return done.error();
  return std::unique_ptr<FlightController>(std::move(controller));
}

ArduPilotController::ArduPilotController(std::unique_ptr<ArduPilotProcess> ardupilot, const Link& link, const Mission& mission,
                                         const StereoRig& rig)
    : CompanionController(
          link, std::make_unique<ArduPilotMission>(mission, rig.imu_noise.rate_hz, link.options.system_id, link.ahead_s), rig),
      ardupilot_(std::move(ardupilot)) {}

Result<void> ArduPilotController::step(const BoardReading& reading, double t_s) {
  newest_height_m_ = height_m_.value_or(newest_height_m_);
  if (Result<void> done = ardupilot_->step(t_s, reading, newest_height_m_); !done) return done;
  commands_ = ardupilot_->commands();
  return {};
}

}  // namespace fbvins
