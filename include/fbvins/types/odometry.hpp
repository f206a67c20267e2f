// SPDX-License-Identifier: Apache-2.0
// What the estimator publishes.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/gauge.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

enum class HealthState {
  initialising,  ///< no pose yet
  good,
  degraded,  ///< a pose, but less accurate than usual; the reason says why
  lost,      ///< no trustworthy pose; a restart follows
};

enum class HealthReason {
  none,
  waiting_for_motion_or_rest,
  too_few_features,
  alignment_refused,  ///< the initial solution was not observable or not plausible
  few_tracks,
  no_tracks,
  no_images,  ///< a gap in the images
  imu_gap,
  implausible_bias,
  implausible_speed,
  solver_failed,
  one_camera,          ///< no stereo matches
  frontend_fault,      ///< the frontend returned features that cannot be: they were left out
  contradiction,       ///< images and IMU readings contradict each other
  cameras_disagree,    ///< one camera contradicts the other and the IMU: its images are not used
  imu_clipped,         ///< an axis of the IMU is at the end of its range
  imu_vibration,       ///< readings are shaken so much that they say little
  correction_pending,  ///< a correction larger than a good pose may be wrong is published step by step
  range_disagrees,     ///< a rangefinder's readings lie on no floor: they are left out
  velocity_disagrees,  ///< a sensor of velocity contradicts the rest: it is left out
  pressure_disagrees,  ///< a barometer does: it is left out
};
inline constexpr HealthReason kLastHealthReason = HealthReason::pressure_disagrees;

std::string_view to_string(HealthState state);
std::string_view to_string(HealthReason reason);

struct Health {
  HealthState state = HealthState::initialising;
  HealthReason reason = HealthReason::none;
  std::uint8_t without_cameras = 0;  ///< bit c: camera c, which delivers nothing or contradicts the others, is not used

  bool has_pose() const { return state == HealthState::good || state == HealthState::degraded; }
  /// Good, or as good as without an aiding sensor that is left out.
  bool is_fine() const { return state == HealthState::good || reason >= HealthReason::range_disagrees; }
  bool operator==(const Health&) const = default;
};
/// In one sentence: "good", "degraded: one_camera, without camera 1".
std::string to_sentence(const Health& health);
/// The numbers of Health::without_cameras.
std::vector<int> cameras_in(std::uint8_t bits);

struct EstimatorStats {
  int frames_in_window = 0;
  int landmarks = 0;
  int known_landmarks = 0;  ///< of these, re-observed: with a prior from when they left the window
  int observations = 0;
  int iterations = 0;
  int outliers = 0;  ///< observations removed after this frame's solve
  double initial_cost = 0;
  double final_cost = 0;
  bool keyframe = false;
  bool standstill = false;
  double prepare_ms = 0, solve_ms = 0, marginalise_ms = 0;
  double total_ms() const { return prepare_ms + solve_ms + marginalise_ms; }
};

/// Tilt uncertainty below which an attitude counts as gravity-aligned (Odometry::level): missions that need it wait for it.
inline constexpr double kLevelSigma_rad = 0.005;

/// One pose of the flight, at an image's stamp. G is the frame of the window, never turned and corrected at once; W is published,
/// gravity-aligned and without jumps; M is W corrected by loop closure. No correction moves T_WB by more than
/// EstimatorOptions::max_step_m from one image to the next, in addition to the motion, unless `reset_counter` counts up.
struct Odometry {
  FrameId id;
  Time t;
  Pose<W, B> T_WB;
  GaugeState gauge;            ///< the same moment in the estimator's own frame
  Vec3 v_WB = Vec3::Zero();    ///< m/s, in W: of the motion, without the rate at which a pending correction is applied
  Vec3 w_WB_B = Vec3::Zero();  ///< rad/s, in B, bias removed
  ImuBias bias;
  Mat6 pose_covariance = Mat6::Zero();        ///< of (dp in W [m], dtheta in B [rad]), including the pending correction
  Mat3 velocity_covariance = Mat3::Zero();    ///< of v_WB, m^2/s^2
  Mat3 gyro_bias_covariance = Mat3::Zero();   ///< rad^2/s^2
  Mat3 accel_bias_covariance = Mat3::Zero();  ///< m^2/s^4
  Vec3 up_W = Vec3::UnitZ();                  ///< unit vector opposite to gravity, as estimated; z once the levelling is applied
  double tilt_sigma_rad = 0;                  ///< standard deviation of the attitude's tilt about its less certain axis
  bool level = false;                         ///< tilt_sigma_rad is below kLevelSigma_rad
  double scale_sigma = 0;    ///< one camera: relative standard deviation of the scale; 0 with a pair or before a pose
  double time_offset_s = 0;  ///< t_imu = t_image + the rig's offset + this, as found so far (docs/derivations/gyro_alignment.md)
  double time_offset_sigma_s = 0;  ///< its standard deviation; 0 where it is not looked for, or not known yet
  Health health;
  std::uint32_t reset_counter =
      0;  ///< +1 whenever W is a new frame: after a restart, or a correction too large to be made slowly
  EstimatorStats stats;
};

/// A read-only picture of the sliding window, levelled.
struct WindowSnapshot {
  struct Frame {
    FrameId id;
    Time t;
    Pose<W, B> T_WB;
    bool keyframe = false;
  };
  struct Landmark {
    LandmarkId id;
    TrackId track;
    Vec3 p_W = Vec3::Zero();
    int observations = 0;
  };
  std::vector<Frame> frames;
  std::vector<Landmark> landmarks;
};

}  // namespace fbvins
