// SPDX-License-Identifier: Apache-2.0
// What a flight's log says of the vehicle: delay, lag and gain of each axis, from how its rate follows torque and its velocity
// follows the acceleration that was asked for. Pure functions.
#pragma once

#include <array>
#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/tuning/frequency_response.hpp"
#include "fbvins/tuning/loop_log.hpp"
#include "fbvins/tuning/loop_model.hpp"

namespace fbvins {

/// A fit and what it was made of.
struct Fit {
  std::vector<FrequencyPoint> points;    ///< those that count
  double misfit_db = 0, misfit_deg = 0;  ///< root mean squares
};
struct RateFit : Fit {
  RatePlant plant;
};
struct VelocityFit : Fit {
  VelocityPlant plant;
};

/// `yaw`: with the torque of rotors that change their speed, which comes at once.
Result<RateFit> fit_rate(const std::vector<double>& torque, const std::vector<double>& rate, const LoopFilters& filters,
                         bool yaw);
/// `loop` without its plant.
Result<VelocityFit> fit_velocity(const std::vector<double>& asked, const std::vector<double>& velocity, const VelocityLoop& loop);

struct VehicleFit {
  std::array<RateFit, 3> rate;          ///< roll, pitch, yaw
  std::array<VelocityFit, 3> velocity;  ///< x, y, z
};
/// One sentence where the log does not show an axis: it was not moved enough.
Result<VehicleFit> fit_vehicle(const LoopLog& log);

LoopFilters filters_of(const LoopLog& log);
RateGains rate_gains(const ControlOptions& control, int axis);
VelocityGains velocity_gains(const ControlOptions& control, int axis);

}  // namespace fbvins
