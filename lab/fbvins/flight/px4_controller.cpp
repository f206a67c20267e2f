// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/px4_controller.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "fbvins/estimator/estimator_options.hpp"

namespace fbvins {
namespace {

constexpr double kSmoothing_s = 0.1;  ///< the default of `fbvins live`
constexpr double kOdometry_hz = 50;
/// Poses of older estimates are not sent, as if the link were silent.
constexpr double kSilent_s = 0.25;
/// PX4's clock at the beginning of the warm-up.
constexpr double kBoot_s = 1;
/// Offset of the companion's clock to PX4's.
constexpr double kCompanionAhead_s = 7000;
constexpr std::uint8_t kCompanion = 191;  // MAV_COMP_ID_ONBOARD_COMPUTER

MavlinkOptions mavlink_options(int system_id, const Pose<BodyFlu, B>& mounting) {
  MavlinkOptions options;
  options.system_id = system_id;
  options.rate_hz = kOdometry_hz;
  // PX4 since February 2026 does not arm with local_frd. There is no GPS or magnetometer with another heading.
  options.frame = MavlinkFrameId::local_ned;
  options.mounting = mounting_options_of(mounting);
  return options;
}

}  // namespace

Result<std::unique_ptr<FlightController>> Px4Controller::create(const Px4Setup& setup, const Mission& mission,
                                                                const ControlOptions& control, const QuadrotorOptions& vehicle,
                                                                const StereoRig& rig, const Pose<BodyFlu, B>& mounting) {
  std::error_code error;
  std::filesystem::remove_all(setup.folder, error);
  std::filesystem::create_directories(setup.folder, error);
  if (error) return Error{ErrorCode::unwritable, fmt::format("{}: {}", setup.folder, error.message())};
  Result<std::unique_ptr<Px4Process>> px4 = Px4Process::start(setup.binary, setup.folder, px4_parameters(control, vehicle));
  if (!px4) return px4.error();
  const MavlinkOptions options = mavlink_options((*px4)->system_id(), mounting);
  std::unique_ptr<Px4Controller> controller(new Px4Controller(*std::move(px4), options, mission, rig));
  if (!controller->link_.open()) return Error{ErrorCode::unreadable, controller->link_.problem()};
  return std::unique_ptr<FlightController>(std::move(controller));
}

Px4Controller::Px4Controller(std::unique_ptr<Px4Process> px4, MavlinkOptions options, const Mission& mission,
                             const StereoRig& rig)
    : px4_(std::move(px4)),
      link_(UdpAddress{"127.0.0.1", px4_->companion_port(), 0}),
      session_(options),
      propagator_(EstimatorOptions{}.assumed(rig.imu_noise), Duration::from_seconds(rig.time_offset_s), kSmoothing_s),
      mission_(mission, rig.imu_noise.rate_hz, px4_->system_id(), kWarmUp_s + kBoot_s) {}

Time Px4Controller::companion_time(double t_s) const {
  return Time{} + Duration::from_seconds(t_s + kWarmUp_s + kCompanionAhead_s);
}

void Px4Controller::send(const MavlinkSession::Frames& frames) {
  if (!px4_->awake()) return;  // nothing listens on the port yet
  for (const std::vector<std::uint8_t>& frame : frames) (void)link_.send(frame);
}

void Px4Controller::receive() {
  const std::vector<std::uint8_t> bytes = link_.receive();
  if (bytes.empty()) return;
  send(session_.receive(bytes, companion_time(now_s_)));
  for (const MavlinkFrame& frame : decoder_.push(bytes)) mission_.receive(frame, now_s_);
}

Result<void> Px4Controller::take_board(const BoardReading& reading) {
  now_s_ = reading.t_s;
  HilSensorMessage message =
      sensor_message(reading, static_cast<std::uint64_t>(std::llround(1e6 * (reading.t_s + kWarmUp_s + kBoot_s))));
  if (height_m_) add_height(message, *height_m_);
  height_m_.reset();
  if (Result<void> done = px4_->step(message); !done) return done;
  for (std::size_t i = 0; i < kRotors; ++i) commands_[i] = static_cast<double>(px4_->controls()[i]);
  receive();
  send(session_.tick(companion_time(now_s_)));
  return {};
}

Result<void> Px4Controller::take(const ImuSample& reading) {
  std::optional<LivePose> at_reading = propagator_.add(reading);
  if (!at_reading) return {};
  LivePose& pose = *at_reading;
  if (!first_) first_ = reading.t;
  const double t_s = (reading.t - *first_).seconds();
  pose.host_t = companion_time(t_s);
  for (const MavlinkMessage& message : mission_.update(pose, t_s))
    send({encode_mavlink(message, {static_cast<std::uint8_t>(px4_->system_id()), kCompanion}, sequence_++)});
  if (mission_.output().estimate_age_s < kSilent_s) send(session_.take(pose));
  return {};
}

}  // namespace fbvins
