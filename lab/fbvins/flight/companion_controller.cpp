// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/companion_controller.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "fbvins/estimator/estimator_setup.hpp"
#include "fbvins/flight/ardupilot_controller.hpp"
#include "fbvins/flight/px4_controller.hpp"

namespace fbvins {
namespace {

constexpr double kPoseSmoothing_s = 0.1;  ///< the default of `fbvins live`
/// Poses of older estimates are not sent, as if the link were silent.
constexpr double kOldEstimate_s = 0.25;
/// Offset of the companion's clock to the flight controller's, roughly.
constexpr double kCompanionAhead_s = 7000;
constexpr std::uint8_t kCompanion = 191;  // MAV_COMP_ID_ONBOARD_COMPUTER

}  // namespace

CompanionController::CompanionController(const Link& link, std::unique_ptr<CompanionMission> mission, const StereoRig& rig)
    : link_(link.address),
      session_(link.options),
      propagator_(assumed_noise(rig.imu_noise, EstimatorOptions{}), Duration::from_seconds(rig.time_offset_s), kPoseSmoothing_s),
      mission_(std::move(mission)),
      system_id_(link.options.system_id),
      warm_up_s_(link.warm_up_s),
      ahead_s_(link.ahead_s) {}

Result<void> CompanionController::open(const std::string& folder) {
  if (!link_.open()) return Error{ErrorCode::unreadable, link_.problem()};
  const std::string path = folder + "/link.tlog";
  if (!log_.open(path)) return Error{ErrorCode::unwritable, fmt::format("{} cannot be written", path)};
  return {};
}

Time CompanionController::companion_time(double t_s) const {
  return Time{} + Duration::from_seconds(t_s + warm_up_s_ + kCompanionAhead_s);
}

void CompanionController::send(const MavlinkSession::Frames& frames) {
  if (!awake() || !link_.has_peer()) return;
  for (const std::vector<std::uint8_t>& frame : frames) {
    (void)link_.send(frame);
    log_.add(frame, static_cast<std::uint64_t>(1e6 * (now_s_ + ahead_s_)));
  }
}

void CompanionController::receive() {
  const std::vector<std::uint8_t> bytes = link_.receive();
  if (bytes.empty()) return;
  if (!link_.has_peer()) link_.pin_to_sender();
  log_.add(bytes, static_cast<std::uint64_t>(1e6 * (now_s_ + ahead_s_)));
  send(session_.receive(bytes, companion_time(now_s_)));
  for (const MavlinkFrame& frame : decoder_.push(bytes)) mission_->receive(frame, now_s_);
}

Result<void> CompanionController::take_board(const BoardReading& reading) {
  now_s_ = reading.t_s;
  if (Result<void> done = step(reading, reading.t_s + ahead_s_); !done) return done;
  height_m_.reset();
  receive();
  send(session_.tick(companion_time(now_s_)));
  return {};
}

Result<void> CompanionController::take(const ImuSample& reading) {
  std::optional<LivePose> at_reading = propagator_.add(reading);
  if (!at_reading) return {};
  LivePose& pose = *at_reading;
  if (!first_) first_ = reading.t;
  const double t_s = (reading.t - *first_).seconds();
  pose.host_t = companion_time(t_s);
  for (const MavlinkMessage& message : mission_->update(pose, t_s))
    send({encode_mavlink(message, {static_cast<std::uint8_t>(system_id_), kCompanion}, sequence_++)});
  if (mission_->output().estimate_age_s < kOldEstimate_s) send(session_.take(pose));
  return {};
}

Result<std::unique_ptr<FlightController>> start_controller(const ControllerProgram& program, const Mission& mission,
                                                           const ControlOptions& control, const QuadrotorOptions& vehicle,
                                                           const StereoRig& rig, const Pose<BodyFlu, B>& mounting) {
  std::error_code error;
  std::filesystem::remove_all(program.folder, error);
  std::filesystem::create_directories(program.folder, error);
  if (error) return Error{ErrorCode::unwritable, fmt::format("{}: {}", program.folder, error.message())};
  if (program.kind == ControllerProgram::Kind::ardupilot)
    return ArduPilotController::create(program, mission, vehicle, rig, mounting);
  return Px4Controller::create(program, mission, control, vehicle, rig, mounting);
}

}  // namespace fbvins
