// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/failsafe.hpp"

namespace fbvins {
namespace {

constexpr double kGoodBeforeTakeoff_s = 1.5, kLongestWait_s = 30;
/// A single weak image is no reason to stop.
constexpr double kDegraded_s = 0.2;
constexpr double kLate_s = 0.25;
/// The propagated pose is used for this long: its error grows with the square of time.
constexpr double kSilent_s = 2.0;
constexpr double kGoodAgain_s = 1.0;
constexpr double kLongestHold_s = 15;
constexpr double kOffPath_m = 1.0, kOffPath_s = 0.5;

}  // namespace

std::string_view to_string(FlightMode mode) {
  switch (mode) {
    case FlightMode::waiting: return "waiting";
    case FlightMode::mission: return "mission";
    case FlightMode::holding: return "holding";
    case FlightMode::landing: return "landing";
    case FlightMode::descending: return "descending";
    case FlightMode::landed: return "landed";
  }
  return "";
}

std::string_view to_string(FlightReason reason) {
  switch (reason) {
    case FlightReason::none: return "none";
    case FlightReason::no_pose: return "no_pose";
    case FlightReason::degraded: return "degraded";
    case FlightReason::late: return "late";
    case FlightReason::restarted: return "restarted";
    case FlightReason::lost: return "lost";
    case FlightReason::off_path: return "off_path";
    case FlightReason::outside_fence: return "outside_fence";
    case FlightReason::flight_controller: return "flight_controller";
  }
  return "";
}

void Failsafe::enter(FlightMode mode, FlightReason reason) {
  mode_ = mode;
  reason_ = reason;
  in_mode_s_ = 0;
  off_path_s_ = 0;
}

/// Why the mission must not continue; also updates the durations.
FlightReason Failsafe::trouble(const FlightCondition& seen, double dt_s) {
  const bool late = seen.estimate_age_s > kLate_s, good = seen.health.state == HealthState::good && !late;
  good_s_ = good && !seen.restarted ? good_s_ + dt_s : 0;
  degraded_s_ = good ? 0 : degraded_s_ + dt_s;
  if (seen.restarted) return FlightReason::restarted;
  if (late) return FlightReason::late;
  return degraded_s_ > kDegraded_s ? FlightReason::degraded : FlightReason::none;
}

FlightMode Failsafe::update(const FlightCondition& seen, double dt_s) {
  in_mode_s_ += dt_s;
  const FlightReason why = trouble(seen, dt_s);
  off_path_s_ = seen.off_path_m > kOffPath_m ? off_path_s_ + dt_s : 0;
  const bool blind = !seen.health.has_pose() || seen.estimate_age_s > kSilent_s;
  const bool flying_by_poses = mode_ == FlightMode::mission || mode_ == FlightMode::holding || mode_ == FlightMode::landing;

  if (flying_by_poses && blind) {
    enter(FlightMode::descending, FlightReason::lost);
    return mode_;
  }
  switch (mode_) {
    case FlightMode::waiting:
      if (good_s_ > kGoodBeforeTakeoff_s) enter(FlightMode::mission, FlightReason::none);
      else if (in_mode_s_ > kLongestWait_s) enter(FlightMode::landed, FlightReason::no_pose);
      break;
    case FlightMode::mission:
    case FlightMode::holding:
      if (seen.landing) enter(FlightMode::landing, FlightReason::none);
      else if (seen.outside_fence) enter(FlightMode::landing, FlightReason::outside_fence);
      else if (off_path_s_ > kOffPath_s) enter(FlightMode::landing, FlightReason::off_path);
      else if (mode_ == FlightMode::mission && why != FlightReason::none) enter(FlightMode::holding, why);
      else if (mode_ == FlightMode::holding && good_s_ > kGoodAgain_s) enter(FlightMode::mission, FlightReason::none);
      else if (mode_ == FlightMode::holding && in_mode_s_ > kLongestHold_s) enter(FlightMode::landing, reason_);
      break;
    case FlightMode::landing:
    case FlightMode::descending:
      if (seen.on_ground) enter(FlightMode::landed, reason_);
      else if (mode_ == FlightMode::descending && good_s_ > kGoodAgain_s) enter(FlightMode::landing, reason_);
      break;
    case FlightMode::landed: break;
  }
  return mode_;
}

}  // namespace fbvins
