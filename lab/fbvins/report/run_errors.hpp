// SPDX-License-Identifier: Apache-2.0
// A run against its ground truth, frame by frame: errors after alignment, and their consistency with the estimator's
// covariances (NEES). Pure functions, any thread.
//
//   RunErrors errors = run_errors(*run);                 // run.truth must not be empty
//   errors.frames[k].absolute_m;                         // after SE3 alignment, as in Table 1
//   errors.frames[k].nees.position;                      // mean 3 when consistent
#pragma once

#include <optional>
#include <vector>

#include "fbvins/eval/evaluation.hpp"
#include "fbvins/report/run_folder.hpp"

namespace fbvins {

/// Normalised estimation errors squared (NEES), each of mean 3 if consistent; NaN if the covariance is not positive definite.
struct StateNees {
  double position = 0, orientation = 0, velocity = 0, gyro_bias = 0, accel_bias = 0;
};

struct FrameError {
  std::size_t frame = 0;  ///< index into the run's odometry
  Pose<W, B> truth;       ///< at the frame's stamp
  Pose<W, B> aligned;     ///< the estimate, aligned with the whole truth (SE3)
  double absolute_m = 0;
  double absolute_deg = 0;
  // For NEES: W is aligned with the truth by translation and yaw at the first pose after a (re)start, where the
  // estimator fixes its gauge. Estimate minus truth, in W.
  Vec3 drift_m = Vec3::Zero();
  Vec3 velocity_error_mps = Vec3::Zero();
  std::optional<ImuBias> bias_error;
  StateNees nees;
};

struct RunErrors {
  std::optional<Evaluation> evaluation;
  std::string no_evaluation;  ///< the reason, if there is none
  std::vector<FrameError> frames;
};

RunErrors run_errors(const RunFolder& run);

/// Truth at an instant by linear interpolation (slerp for the rotation); none in gaps longer than `longest_s`.
std::optional<TrajectoryPoint> truth_at(const std::vector<TrajectoryPoint>& truth, Time t, double longest_s = 0.25);

}  // namespace fbvins
