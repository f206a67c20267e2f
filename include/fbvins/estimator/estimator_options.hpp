// SPDX-License-Identifier: Apache-2.0
// Options of the estimator, with defaults and units.
#pragma once

#include "fbvins/core/options.hpp"

namespace fbvins {

/// Which keyframe leaves a full window.
enum class KeyframeLeaving { oldest, entropy };

struct KeyframeOptions {
  int max_keyframes = 8;
  int newest_frames = 3;  ///< kept beside them, keyframes or not; set by tests
  KeyframeLeaving leaving = KeyframeLeaving::oldest;

  template <class V>
  void visit(V&& v) {
    v("max_keyframes", max_keyframes, "", "keyframes in the sliding window", 3, 30);
    v("leaving", leaving, "oldest|entropy",
      "which keyframe leaves a full window: the oldest, or the one with the least information on the newest (paper 2.1.2)");
  }
};

struct KnownLandmarkOptions {
  bool enabled = true;
  int capacity = 20000;            ///< landmarks remembered
  double position_sigma_m = 0.01;  ///< of a landmark's position, in addition to that of its triangulation; set by tests

  template <class V>
  void visit(V&& v) {
    v("enabled", enabled, "", "re-observed landmarks constrain the window");
  }
};

/// A vehicle that stands level before its first start (docs/derivations/alignment.md, A22-A24).
struct StandingOptions {
  double tilt_rad = 0;
  double up_x = 0, up_y = 0, up_z = 1;

  template <class V>
  void visit(V&& v) {
    v("tilt_rad", tilt_rad, "rad",
      "at its first start the vehicle stands level to this standard deviation, the IMU's mounting included; 0: not known", 0.0,
      0.2);
    v("up_x", up_x, "", "the vehicle's up in the IMU's frame, any length", -1.0, 1.0);
    v("up_y", up_y, "", "likewise", -1.0, 1.0);
    v("up_z", up_z, "", "likewise", -1.0, 1.0);
  }
};

/// Readings of a rangefinder (docs/rangefinder.md).
struct RangefinderOptions {
  bool enabled = true;
  double floor_sigma_m = 0.015;

  template <class V>
  void visit(V&& v) {
    v("enabled", enabled, "", "readings of a rangefinder constrain the height above the floor");
    v("floor_sigma_m", floor_sigma_m, "m", "standard deviation of a level floor's unevenness, in addition to the readings'",
      0.001, 0.5);
  }
};

/// Readings of a sensor of velocity: wheels, optical flow (docs/velocity.md).
struct VelocityOptions {
  bool enabled = true;
  double slip_mps = 0.3;

  template <class V>
  void visit(V&& v) {
    v("enabled", enabled, "", "readings of a sensor of velocity are used");
    v("slip_mps", slip_mps, "m/s",
      "readings that are further off the predicted velocity, and by four standard deviations, are left out", 0.01, 10.0);
  }
};

/// Readings of a barometer (docs/barometer.md).
struct BarometerOptions {
  bool enabled = true;
  double drift_m_rts = 0.03;

  template <class V>
  void visit(V&& v) {
    v("enabled", enabled, "", "readings of a barometer constrain the height");
    v("drift_m_rts", drift_m_rts, "m/sqrt(s)", "random walk of the height that it says: weather, ventilation, its temperature",
      0.001, 10.0);
  }
};

struct EstimatorOptions {
  KeyframeOptions keyframes;
  KnownLandmarkOptions known_landmarks;
  StandingOptions standing;
  RangefinderOptions rangefinder;
  VelocityOptions velocity;
  BarometerOptions barometer;
  int max_iterations = 4;
  int max_landmarks = 300;
  double gravity_mps2 = 9.81;
  double gyro_noise_scale = 1;  ///< set by tests
  double accel_noise_scale = 1;
  double gyro_unmodelled_radps_rthz = 3.5e-4;  ///< what axes and scale leave, in addition to the calibrated noise; set by tests
  double accel_unmodelled_mps2_rthz = 0.005;   ///< likewise
  double gyro_walk_scale = 5.0;                ///< factors on the calibrated random walks of the biases; set by tests
  double accel_walk_scale = 0.4;               ///< likewise
  bool estimate_extrinsics = false;
  bool estimate_time_offset = false;
  bool estimate_line_delay = false;
  bool align_time_offset = true;
  double max_blind_m = 0.5;
  double max_imu_gap_s = 1.0;
  int min_tracks = 10;
  double max_speed_mps = 30;
  double max_step_m = 0.0015;
  double max_pending_m = 0.1;

  template <class V>
  void visit(V&& v) {
    v.group("keyframes", keyframes, "the sliding window");
    v.group("known_landmarks", known_landmarks, "landmarks that have left the window");
    v.group("standing", standing, "a vehicle that stands level before it flies");
    v.group("rangefinder", rangefinder, "a beam to the floor");
    v.group("velocity", velocity, "wheels, optical flow");
    v.group("barometer", barometer, "height by the pressure of the air");
    v("max_iterations", max_iterations, "", "Levenberg-Marquardt iterations per frame", 1, 100);
    v("max_landmarks", max_landmarks, "", "landmarks in the solver", 20, 5000);
    v("gravity_mps2", gravity_mps2, "m/s^2", "magnitude of gravity", 9.7, 9.9);
    v("accel_noise_scale", accel_noise_scale, "", "factor on the calibrated accelerometer noise density", 0.1, 100.0);
    v("estimate_extrinsics", estimate_extrinsics, "", "refine the camera-IMU poses while flying");
    v("estimate_time_offset", estimate_time_offset, "", "refine the camera-IMU time offset while flying");
    v("align_time_offset", align_time_offset, "",
      "find a time offset between images and IMU that the calibration does not know, up to 0.1 s, by gyroscope and tracks");
    v("estimate_line_delay", estimate_line_delay, "", "refine the line delay of a rolling shutter while flying");
    v("max_blind_m", max_blind_m, "m",
      "largest standard deviation that flight by the IMU alone, without usable images, may add to the position", 0.01, 100.0);
    v("max_imu_gap_s", max_imu_gap_s, "s", "longest time without IMU readings bridged by the images", 0.01, 10.0);
    v("min_tracks", min_tracks, "", "fewer landmarks than this in view: degraded", 3, 200);
    v("max_speed_mps", max_speed_mps, "m/s", "faster is implausible and restarts the estimator", 1.0, 1000.0);
    v("max_step_m", max_step_m, "m",
      "largest correction of the published position from one image to the next, attitude in proportion; 0: no limit", 0.0, 1.0);
    v("max_pending_m", max_pending_m, "m",
      "no good pose has a larger correction before it (attitude: 3 degrees for 0.1 m); twice as large, or soon after a pose that "
      "was not good, it is made at once and counted as a reset; 0: no limit",
      0.0, 100.0);
  }
};

}  // namespace fbvins
