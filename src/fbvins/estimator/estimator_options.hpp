// SPDX-License-Identifier: Apache-2.0
// Options of the estimator, with defaults and units.
#pragma once

#include <string>

#include "fbvins/core/options.hpp"
#include "fbvins/imu/alignment.hpp"
#include "fbvins/imu/static_initialiser.hpp"

namespace fbvins {

struct InitialiserOptions {
  int frames = 10;  // images looked at
  double min_spacing_s = 0.045;
  double max_rest_motion_px = 0.6;
  int min_features = 20;
  double tilt_sigma_rad = 0.5;
  double gyro_bias_sigma_radps = 0.1;
  double accel_bias_sigma_mps2 = 0.2;
  double velocity_sigma_mps = 5;
  AlignmentOptions alignment;
  RestOptions rest;

  template <class V>
  void visit(V&& v) {
    v("frames", frames, "", "images an initial solution is made from", 4, 30);
    v("min_spacing_s", min_spacing_s, "s", "least time between these images", 0.001, 1.0);
    v("max_rest_motion_px", max_rest_motion_px, "px", "median image motion that still counts as rest", 0.05, 10.0);
    v("min_features", min_features, "", "stereo features needed in each of these images", 6, 500);
    v("tilt_sigma_rad", tilt_sigma_rad, "rad", "prior standard deviation of roll and pitch", 1e-4, 3.0);
    v("gyro_bias_sigma_radps", gyro_bias_sigma_radps, "rad/s", "prior standard deviation of the gyroscope bias", 1e-5, 1.0);
    v("accel_bias_sigma_mps2", accel_bias_sigma_mps2, "m/s^2", "prior standard deviation of the accelerometer bias", 1e-4, 5.0);
    v("velocity_sigma_mps", velocity_sigma_mps, "m/s", "prior standard deviation of the velocity", 1e-3, 100.0);
    v.group("alignment", alignment, "start in motion");
    v.group("rest", rest, "start from rest");
  }
};

struct KeyframeOptions {
  int max_keyframes = 8;
  int newest_frames = 3;
  std::string leaving = "oldest";
  double min_parallax_px = 12;
  double min_shared_ratio = 0.7;
  double max_interval_s = 1.0;

  template <class V>
  void visit(V&& v) {
    v("max_keyframes", max_keyframes, "", "keyframes in the sliding window", 3, 30);
    v("newest_frames", newest_frames, "", "newest frames kept beside them, keyframes or not", 2, 10);
    v("leaving", leaving, "oldest|entropy",
      "which keyframe leaves a full window: the oldest, or the one whose measurements tell least (paper 2.1.2)");
    v("min_parallax_px", min_parallax_px, "px", "mean rotation-free image motion since the last keyframe that makes a new one",
      0.5, 100.0);
    v("min_shared_ratio", min_shared_ratio, "", "a new keyframe when fewer of the features than this were seen by the last one",
      0.1, 1.0);
    v("max_interval_s", max_interval_s, "s", "a new keyframe after this time at the latest, unless standing still", 0.1, 10.0);
  }
};

/// How far the calibration may be off, where it is estimated.
struct CalibrationBelief {
  double rotation_sigma_rad = 0.02;
  double position_sigma_m = 0.01;
  double stereo_rotation_sigma_rad = 2e-4;
  double stereo_position_sigma_m = 1e-4;
  double time_offset_sigma_s = 0.005;

  template <class V>
  void visit(V&& v) {
    v("rotation_sigma_rad", rotation_sigma_rad, "rad", "prior standard deviation of the cameras' rotation to the IMU", 1e-6, 1.0);
    v("position_sigma_m", position_sigma_m, "m", "prior standard deviation of the cameras' position in the IMU's frame", 1e-6,
      1.0);
    v("stereo_rotation_sigma_rad", stereo_rotation_sigma_rad, "rad", "the same of the rotation between the cameras", 1e-6, 1.0);
    v("stereo_position_sigma_m", stereo_position_sigma_m, "m", "the same of the right camera's position in the left one's frame",
      1e-6, 1.0);
    v("time_offset_sigma_s", time_offset_sigma_s, "s", "prior standard deviation of the time offset", 1e-6, 1.0);
  }
};

struct KnownLandmarkOptions {
  bool enabled = true;
  int capacity = 20000;
  double position_sigma_m = 0.01;
  double max_relative_depth_sigma = 0.05;
  double outlier_sigma = 6;

  template <class V>
  void visit(V&& v) {
    v("enabled", enabled, "", "landmarks seen again are held to where they were");
    v("capacity", capacity, "", "landmarks remembered", 0, 10000000);
    v("position_sigma_m", position_sigma_m, "m",
      "standard deviation of where a landmark is in the map, beside what its depth leaves open", 1e-4, 1.0);
    v("max_relative_depth_sigma", max_relative_depth_sigma, "",
      "standard deviation of the depth, as a share of it, of those remembered", 1e-4, 1.0);
    v("outlier_sigma", outlier_sigma, "sigma", "a landmark further off than this is another one", 0.5, 100.0);
  }
};

struct EstimatorOptions {
  InitialiserOptions initialiser;
  KeyframeOptions keyframes;
  KnownLandmarkOptions known_landmarks;
  int max_iterations = 4;
  int max_landmarks = 300;
  double huber_sigma = 2.0;
  double outlier_sigma = 4.0;
  double min_depth_m = 0.1;
  double max_depth_m = 200;
  double gravity_mps2 = 9.81;
  double gyro_noise_scale = 2.5;
  double accel_noise_scale = 16.0;
  double gyro_walk_scale = 5.0;
  double accel_walk_scale = 0.4;
  bool estimate_extrinsics = false;
  bool estimate_time_offset = false;
  CalibrationBelief calibration;
  double standstill_velocity_sigma_mps = 0.01;
  double max_image_gap_s = 3.0;
  double max_imu_gap_s = 1.0;
  int min_tracks = 10;
  double max_speed_mps = 30;
  double max_gyro_bias_radps = 0.5;
  double max_accel_bias_mps2 = 2.5;

  template <class V>
  void visit(V&& v) {
    v.group("initialiser", initialiser, "start, from rest or in motion");
    v.group("keyframes", keyframes, "the sliding window");
    v.group("known_landmarks", known_landmarks, "landmarks that have left the window");
    v("max_iterations", max_iterations, "", "Levenberg-Marquardt iterations per frame", 1, 100);
    v("max_landmarks", max_landmarks, "", "landmarks in the solver", 20, 5000);
    v("huber_sigma", huber_sigma, "sigma", "reprojection errors beyond this count linearly", 0.1, 100.0);
    v("outlier_sigma", outlier_sigma, "sigma", "observations further off than this are removed after the solve", 0.5, 100.0);
    v("min_depth_m", min_depth_m, "m", "nearest landmark", 0.01, 10.0);
    v("max_depth_m", max_depth_m, "m", "landmarks beyond are kept at this distance", 1.0, 100000.0);
    v("gravity_mps2", gravity_mps2, "m/s^2", "magnitude of gravity", 9.7, 9.9);
    v("gyro_noise_scale", gyro_noise_scale, "", "factor on the calibrated gyroscope noise density", 0.1, 100.0);
    v("accel_noise_scale", accel_noise_scale, "", "factor on the calibrated accelerometer noise density (vibration)", 0.1, 100.0);
    v("gyro_walk_scale", gyro_walk_scale, "", "factor on the calibrated gyroscope bias random walk", 0.01, 100.0);
    v("accel_walk_scale", accel_walk_scale, "", "factor on the calibrated accelerometer bias random walk", 0.01, 100.0);
    v("estimate_extrinsics", estimate_extrinsics, "", "refine the camera-IMU poses while flying");
    v("estimate_time_offset", estimate_time_offset, "", "refine the camera-IMU time offset while flying");
    v.group("calibration", calibration, "how far the calibration is believed, where it is refined");
    v("standstill_velocity_sigma_mps", standstill_velocity_sigma_mps, "m/s",
      "how firmly a recognised standstill holds the velocity at zero", 1e-4, 1.0);
    v("max_image_gap_s", max_image_gap_s, "s", "longest time without usable images bridged by the IMU", 0.1, 60.0);
    v("max_imu_gap_s", max_imu_gap_s, "s", "longest time without IMU readings bridged by the images", 0.01, 10.0);
    v("min_tracks", min_tracks, "", "fewer landmarks than this in view: degraded", 3, 200);
    v("max_speed_mps", max_speed_mps, "m/s", "faster is implausible and restarts the estimator", 1.0, 1000.0);
    v("max_gyro_bias_radps", max_gyro_bias_radps, "rad/s", "a larger bias is implausible", 0.001, 10.0);
    v("max_accel_bias_mps2", max_accel_bias_mps2, "m/s^2", "a larger bias is implausible", 0.01, 20.0);
  }
};

}  // namespace fbvins
