// SPDX-License-Identifier: Apache-2.0
// A run against its truth, frame by frame: errors as a person wants to see them, and whether they are as large as
// the estimator's own covariances say. Pure functions, any thread.
//
//   RunErrors errors = run_errors(*run);                 // run.truth must not be empty
//   errors.frames[k].absolute_m;                         // after SE3 alignment: what Table 1 sums up
//   errors.frames[k].nees.position;                      // mean 3 when consistent
#pragma once

#include <optional>
#include <vector>

#include "fbvins/eval/evaluation.hpp"
#include "fbvins/report/run_folder.hpp"

namespace fbvins {

/// Normalised errors squared, each of mean 3 when the covariance is consistent; not-a-number where it is unusable.
struct StateNees {
  double position = 0, orientation = 0, velocity = 0, gyro_bias = 0, accel_bias = 0;
};

struct FrameError {
  std::size_t frame = 0;  ///< index into the run's odometry
  Pose<W, B> truth;       ///< at the frame's stamp
  Pose<W, B> aligned;     ///< the estimate, laid over the whole truth (SE3)
  double absolute_m = 0;
  double absolute_deg = 0;
  // Against the frame's own covariance: W is laid over the truth at the first pose after a (re)start, by shift and
  // yaw, because that is where the estimator defines it. Estimate minus truth, in W.
  Vec3 drift_m = Vec3::Zero();
  Vec3 velocity_error_mps = Vec3::Zero();
  std::optional<ImuBias> bias_error;
  StateNees nees;
};

struct RunErrors {
  std::optional<Evaluation> evaluation;
  std::string no_evaluation;  ///< why there is none
  std::vector<FrameError> frames;
};

RunErrors run_errors(const RunFolder& run);

/// Truth at an instant, linear between its neighbours; nothing where they are further apart than `longest_s`.
std::optional<TrajectoryPoint> truth_at(const std::vector<TrajectoryPoint>& truth, Time t, double longest_s = 0.25);

}  // namespace fbvins
