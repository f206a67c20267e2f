// SPDX-License-Identifier: Apache-2.0
// Visual-inertial alignment in motion (paper 2.2.4; docs/derivations/alignment.md, eq. A6-A20):
// from metric body poses in an arbitrary visual world and the readings between them, the gyro bias,
// the direction of gravity, the velocities and, as far as it is observable, the accelerometer bias.
//
//   std::vector<Pose<VisualWorld, B>> poses = ...;    // from stereo, n of them
//   std::vector<Preintegration> between = ...;        // n - 1, consecutive
//   AlignmentResult a = align_visual_inertial(poses, between, options);
//   if (a.accepted) start(a.states);                  // else a.reason says why not
//
// A window without motion is fine: gravity then comes from the accelerometers alone, the accelerometer
// bias stays at its prior, as accel_bias_sigma_mps2 shows. Threads: pure function.
#pragma once

#include <string_view>
#include <vector>

#include "fbvins/imu/nav_state.hpp"
#include "fbvins/imu/preintegration.hpp"

namespace fbvins {

/// Frame of the visual structure: metric scale, orientation and origin arbitrary.
struct VisualWorld {};

struct AlignmentOptions {
  int min_frames = 4;                   ///< visual poses needed
  double min_duration_s = 0.3;          ///< shortest window
  double pose_sigma_m = 2e-3;           ///< noise of each visual position
  double pose_sigma_rad = 1.5e-3;       ///< noise of each visual orientation
  double gyro_bias_prior_radps = 0.3;   ///< sigma about zero
  Vec3 accel_bias_mps2 = Vec3::Zero();  ///< mean of its prior
  double accel_bias_prior_mps2 = 0.1;   ///< sigma about that
  double max_gravity_error_mps2 = 0.8;  ///< of the norm, solved without constraint
  double max_gravity_sigma_rad = 0.05;  ///< about 3 degrees
  double max_gyro_bias_radps = 0.25;    ///< larger is implausible
  double max_gyro_bias_sigma_radps = 0.03;
  double max_accel_bias_mps2 = 1.0;  ///< larger is implausible
  double max_residual_rms = 4.0;     ///< in sigmas
  double max_gap_s = 0.05;           ///< longest in the readings
};

enum class AlignmentRefusal {
  none,
  too_few_frames,
  too_short,
  bad_input,  ///< numbers not finite, empty intervals, or sizes that do not match
  imu_gap,
  solver_failed,
  gyro_bias_unobservable,
  gyro_bias_implausible,
  rotation_inconsistent,  ///< gyro and visual rotations disagree
  gravity_magnitude,      ///< not that of the earth: wrong scale, poses or readings
  gravity_unobservable,
  accel_bias_implausible,
  motion_inconsistent,  ///< accelerometer and visual positions disagree
};

std::string_view to_string(AlignmentRefusal reason);

struct AlignmentResult {
  bool accepted = false;
  AlignmentRefusal reason = AlignmentRefusal::none;

  /// G, which begins here: z up as far as gravity is known, origin at the first body pose, heading such that R_GB of the
  /// first pose has no rotation about gravity (level_rotation of static_initialiser.hpp).
  Quat R_GV = Quat::Identity();
  ImuBias bias;
  std::vector<NavState<G>> states;  ///< one a pose: the visual pose in G, velocity, bias

  // Diagnostics, filled as far as the computation went.
  double gravity_norm_mps2 = 0;        ///< without constraint on its magnitude
  double gravity_sigma_rad = 0;        ///< standard deviation of the direction, worst axis
  double gravity_information_min = 0;  ///< smallest eigenvalue of the unconstrained 3x3 information
  double gravity_condition = 0;        ///< its condition number
  double gyro_bias_sigma_radps = 0;    ///< worst axis
  double accel_bias_sigma_mps2 = 0;    ///< worst axis; that of the prior where motion does not observe it
  double velocity_sigma_mps = 0;       ///< of the last velocity, worst axis
  double rotation_rms = 0;             ///< in sigmas
  double motion_rms = 0;               ///< in sigmas
};

/// between[k] joins poses[k] and poses[k + 1]. On acceptance all intervals are repropagated at the bias
/// found; on refusal at an unspecified bias.
AlignmentResult align_visual_inertial(const std::vector<Pose<VisualWorld, B>>& poses, std::vector<Preintegration>& between,
                                      const AlignmentOptions& options = {}, double gravity_mps2 = kGravity_mps2);

}  // namespace fbvins
