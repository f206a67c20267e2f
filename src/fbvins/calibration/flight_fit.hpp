// SPDX-License-Identifier: Apache-2.0
// Private: one calibration for all pieces of flights, by Gauss-Newton steps of the calibration with states and points following
// in each piece. One thread; the same input gives the same bytes.
#pragma once

#include <vector>

#include "fbvins/calibration/flight_piece.hpp"

namespace fbvins {

using FlightPieces = std::vector<FlightPiece*>;

struct FlightFit {
  FlightRig rig;
  Eigen::MatrixXd information;  ///< of all parameters by views and readings, `spread` regarded; empty if none is free
  double cost = 0;              ///< at the minimum, without the prior
  int iterations = 0;
};

/// Minimises over the parameters that `free` marks, which are expected to be within their prior sigmas of `given`.
FlightFit fit_calibration(const FlightPieces& pieces, const FlightRig& given, const FlightRig& start,
                          const std::vector<bool>& free, const FlightNoise& noise);
/// Half the sum of squares of what is seen and read, at its minimum over states and points.
double settled_cost(const FlightPieces& pieces, const FlightRig& rig, const FlightNoise& noise);

/// Standard deviation of a coordinate as the residuals show it: by their median, and regarding that points are fitted.
double sigma_px_of(const FlightPieces& pieces, const FlightRig& rig);
/// FlightNoise::gyro and accel that make the readings most likely; else as `noise`.
FlightNoise with_noise_of_readings(const FlightPieces& pieces, const FlightRig& rig, const FlightNoise& noise);
/// FlightNoise::spread, from what each piece says beside the others at a minimum over all parameters.
double spread_of(const FlightPieces& pieces, const FlightFit& fit, const FlightNoise& noise);

/// Inverse variances of the prior.
Eigen::VectorXd prior_information(const FlightRig& given);

}  // namespace fbvins
