// SPDX-License-Identifier: Apache-2.0
// A better calibration from flights without a board: lenses, extrinsics of both kinds, time offset and the IMU's axes, each as
// far as the flights determine it, judged by flights or halves that it was not fitted to (docs/derivations/calibration.md). One
// thread; the same input gives the same bytes.
//
//   Result<FlightCalibration> found = calibrate_from_flights({tracks}, rig, {});
//   if (!found) report(found.error().message);          // the flights are too short
//   else if (found->better) fly_with(found->rig);
//   else report(found->verdict);
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fbvins/calibration/flight_rig.hpp"
#include "fbvins/calibration/flight_tracks.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

struct FlightCalibrationOptions {
  std::function<void(const std::string&)> on_progress = {};  ///< a few words
  /// If any: these alone are refined, whether or not chance explains the change; they are known to be rough, and the others
  /// right.
  std::vector<FlightGroup> rough = {};
};

enum class FlightFinding {
  refined,         ///< changed
  confirmed,       ///< determined, and as given
  left,            ///< as given: held-out parts are predicted better so
  not_determined,  ///< by these flights: as given
};

struct RefinedParameter {
  std::string name, unit;
  double given = 0, value = 0;
  double change = 0;  ///< that all flights together ask for, taken or not; of a rotation: of its part about this axis
  double sigma = 0;   ///< by `covariance`
  double prior_sigma = 0;
  FlightFinding finding = FlightFinding::not_determined;
};

/// A part of the flights as the given calibration predicts it, and as one does that was fitted to all other parts.
struct HeldOutPart {
  std::string name;
  bool changed = true;            ///< the other parts change something
  double given = 0, refined = 0;  ///< half sums of squares
  double gain = 0;                ///< their difference over `spread`; positive: the refined one predicts better
};

struct FlightCalibration {
  StereoRig rig;  ///< refined where it is better, as given elsewhere
  bool better = false;
  std::string verdict;  ///< one sentence
  std::vector<RefinedParameter> parameters;
  Eigen::MatrixXd covariance;  ///< of `parameters`, with all of them unknown
  std::vector<HeldOutPart> held_out;
  ImuTriads axes;
  int pieces = 0, keyframes = 0, points = 0, views = 0;
  double duration_s = 0;
  double sigma_px = 0, spread = 1;                              ///< FlightNoise
  double gyro_noise_radps_rthz = 0, accel_noise_mps2_rthz = 0;  ///< densities as the flights show them
};

/// `names`: of the flights. An error, one sentence, where the flights cannot be used or are too short.
Result<FlightCalibration> calibrate_from_flights(const std::vector<FlightTracks>& flights, const std::vector<std::string>& names,
                                                 const StereoRig& rig, const FlightCalibrationOptions& options);

}  // namespace fbvins
