// SPDX-License-Identifier: Apache-2.0
// System identification from a flight's log: gain, lag and delay of each axis, from torque to rate and from acceleration setpoint
// to velocity. Pure functions.
#pragma once

#include <array>

#include "fbvins/core/result.hpp"
#include "fbvins/tuning/frequency_response.hpp"
#include "fbvins/tuning/loop_log.hpp"
#include "fbvins/tuning/loop_model.hpp"

namespace fbvins {

/// The measured points of a fit and its residuals.
struct Fit {
  std::vector<FrequencyPoint> points;    ///< those with enough coherence
  double misfit_db = 0, misfit_deg = 0;  ///< root mean square residuals
};
struct RateFit : Fit {
  RatePlant plant;
};
struct VelocityFit : Fit {
  VelocityPlant plant;
};

/// `yaw`: with a lead, for the immediate reaction torque of rotors that change their speed.
Result<RateFit> fit_rate(const std::vector<double>& torque, const std::vector<double>& rate, const LoopFilters& filters,
                         bool yaw);
/// `loop`: all but its plant, which is fitted.
Result<VelocityFit> fit_velocity(const std::vector<double>& asked, const std::vector<double>& velocity, const VelocityLoop& loop);

struct VehicleFit {
  std::array<RateFit, 3> rate;          ///< roll, pitch, yaw
  std::array<VelocityFit, 3> velocity;  ///< x, y, z
};
/// Error, in one sentence, if an axis was not excited enough.
Result<VehicleFit> fit_vehicle(const LoopLog& log);

LoopFilters filters_of(const LoopLog& log);
RateGains rate_gains(const ControlOptions& control, int axis);
VelocityGains velocity_gains(const ControlOptions& control, int axis);

}  // namespace fbvins
