// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/mavlink_aiding.hpp"

#include <cmath>
#include <cstdlib>

#include "fbvins/live/mavlink_peer.hpp"
#include "fbvins/mavlink/vehicle_frames.hpp"

namespace fbvins {
namespace {

constexpr Duration kAskEvery{2'000'000'000};
/// Stamps further from their arrival are of a clock that is not known.
constexpr Duration kFarthestStamp{1'000'000'000};
constexpr std::uint64_t kLastClock_usec = 3'800'000'000'000'000;

/// Where a sensor of that orientation looks, forward-right-down; none for one that is not known.
std::optional<Vec3> direction_F(const DistanceSensorMessage& m) {
  switch (m.orientation) {
    case 0: return Vec3(1, 0, 0);
    case 2: return Vec3(0, 1, 0);
    case 4: return Vec3(-1, 0, 0);
    case 6: return Vec3(0, -1, 0);
    case 24: return Vec3(0, 0, -1);
    case DistanceSensorMessage::kDown: return Vec3(0, 0, 1);
    default: break;
  }
  const Quat q(m.quaternion[0], m.quaternion[1], m.quaternion[2], m.quaternion[3]);
  if (m.orientation != DistanceSensorMessage::kCustom || !(std::abs(q.norm() - 1) < 0.01)) return std::nullopt;
  return q.normalized() * Vec3::UnitX();
}

std::optional<AidingSample> range_of(const DistanceSensorMessage& m, const Pose<B, B>& T_BF, Time t) {
  const auto direction = direction_F(m);
  if (!direction || m.signal_quality == DistanceSensorMessage::kInvalid || m.max_distance <= m.min_distance) return std::nullopt;
  RangeSample r{.t = t, .distance_m = 0.01 * m.current_distance};
  r.nearest_m = 0.01 * m.min_distance, r.farthest_m = 0.01 * m.max_distance;
  if (m.covariance != DistanceSensorMessage::kUnknownVariance && m.covariance > 0) r.sigma_m = 0.01 * std::sqrt(m.covariance);
  r.p_B = T_BF.p, r.direction_B = T_BF.q * *direction;
  return r;
}

/// Sensor motion to the right makes a negative flow about x, and ahead a positive one about y.
std::optional<AidingSample> velocity_of(const OpticalFlowRadMessage& m, const Pose<B, B>& T_BF, Time t) {
  constexpr double kNoise_mps = 0.05, kNoise_radps = 0.1;
  const double dt_s = 1e-6 * m.integration_time_us;
  if (m.quality == 0 || !(m.distance > 0) || !(dt_s > 0)) return std::nullopt;
  VelocitySample v;
  v.t = t - Duration::from_seconds(dt_s / 2);
  v.v_mps = Vec3(m.integrated_y - m.integrated_ygyro, -(m.integrated_x - m.integrated_xgyro), 0) * (m.distance / dt_s);
  const double sigma = std::hypot(kNoise_mps, kNoise_radps * m.distance) * 255 / m.quality;
  v.sigma_mps = Vec3(sigma, sigma, kUnmeasured_mps);
  v.p_B = T_BF.p, v.q_BS = T_BF.q;
  return v;
}

CommandMessage request(std::uint32_t message, double rate_hz, const MavlinkAddress& to) {
  CommandMessage command;
  command.command = kMavCmdSetMessageInterval;
  command.params = {static_cast<float>(message), static_cast<float>(1e6 / rate_hz)};
  command.target_system = to.system, command.target_component = to.component;
  return command;
}

}  // namespace

MavlinkAiding::MavlinkAiding(const MavlinkAidingOptions& options, const MountingOptions& mounted)
    : options_(options),
      T_BF_(mounting(mounted).inverse().cast_frames<B, B>()),
      wanted_{{{DistanceSensorMessage::kId, options.range},
               {OpticalFlowRadMessage::kId, options.flow},
               {ScaledPressureMessage::kId, options.pressure}}} {}

/// On the flight controller's clock.
std::optional<AidingSample> MavlinkAiding::as_reading(const MavlinkMessage& message, Time now_theirs) const {
  if (const auto* range = std::get_if<DistanceSensorMessage>(&message); range != nullptr && options_.range) {
    if (range->orientation != options_.orientation) return std::nullopt;
    return range_of(*range, T_BF_, unwrapped(range->time_boot_ms, now_theirs));
  }
  if (const auto* flow = std::get_if<OpticalFlowRadMessage>(&message); flow != nullptr && options_.flow) {
    if (flow->time_usec > kLastClock_usec) return std::nullopt;
    return velocity_of(*flow, T_BF_, Time{static_cast<std::int64_t>(flow->time_usec) * 1000});
  }
  if (const auto* pressure = std::get_if<ScaledPressureMessage>(&message); pressure != nullptr && options_.pressure)
    return PressureSample{unwrapped(pressure->time_boot_ms, now_theirs), 100.0 * pressure->press_abs, 3};
  return std::nullopt;
}

std::optional<AidingSample> MavlinkAiding::read(const MavlinkMessage& message, Duration offset, Time now) {
  std::optional<AidingSample> reading = as_reading(message, now + offset);
  if (!reading || !impossible(*reading).empty()) return std::nullopt;
  wanted_[reading->index()].newest = now;
  stamp_of(*reading) = stamp_of(*reading) - offset;
  if (std::abs((stamp_of(*reading) - now).ns) > kFarthestStamp.ns) return std::nullopt;
  return reading;
}

std::vector<CommandMessage> MavlinkAiding::requests(const MavlinkAddress& to, Time now) {
  std::vector<CommandMessage> out;
  for (Wanted& w : wanted_)
    if (w.wanted && now - w.newest > kAskEvery && is_due(now, kAskEvery, w.next_request))
      out.push_back(request(w.message, options_.rate_hz, to));
  return out;
}

}  // namespace fbvins
