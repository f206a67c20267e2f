// SPDX-License-Identifier: Apache-2.0
// What the parts of an estimator take from the rig, the options, a tracked frame and a start. Pure functions.
#pragma once

#include "fbvins/camera/camera.hpp"
#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/estimator/frame_list.hpp"
#include "fbvins/estimator/initialiser.hpp"
#include "fbvins/estimator/window_problem.hpp"

namespace fbvins {

/// `images_show_scale`: not with one camera.
WindowWeights weights_of(const EstimatorOptions& options, bool images_show_scale = true);

/// Where no two cameras see the same things, remembered landmarks would hold the scale at what it was thought to be when they
/// left the window. The place of a camera that only stands for a depth sensor is none to be refined.
EstimatorOptions for_cameras_of(const StereoRig& rig, EstimatorOptions options);

/// The noise that readings are weighted with where nothing vibrates (ReadingNoise adds that), from the calibrated one.
ImuNoise assumed_noise(ImuNoise calibrated, const EstimatorOptions& options);

/// As the rig says, with a time offset of zero: stamps are on the IMU's clock already.
Calibration calibration_of(const StereoRig& rig);

/// Relative standard deviation of the calibrated scale (W21): of the pair with the largest baseline, or of the depth sensor; 0
/// where neither is there.
double scale_sigma_of(const StereoRig& rig);

/// A frame of the window, whose state and readings are still to come.
Frame without_state(const TrackedFrame& tracked);
/// What the other cameras see.
std::vector<TrackedFeature> without_cameras(std::vector<TrackedFeature> features, std::uint8_t cameras);
/// The start's frame of that number, with its state and its readings.
Frame frame_of_start(const InitialSolution& start, std::size_t number, const ImuNoise& noise);

}  // namespace fbvins
