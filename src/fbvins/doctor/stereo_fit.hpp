// SPDX-License-Identifier: Apache-2.0
// The stereo pair's calibration judged by the epipolar error of matches that were found without it. Finds the single change of
// the calibration that explains most of the error, then the next. Method: docs/doctor.md. Pure functions, any thread.
//
//   StereoFit fit = fit_stereo(views, rig, &imu, pairs);
//   for (const StereoChange& change : fit.changes) report(change);
//   use(fit.rig);                                         // with the changes
#pragma once

#include <array>
#include <span>
#include <vector>

#include "fbvins/checkup/finding.hpp"
#include "fbvins/doctor/evidence.hpp"
#include "fbvins/doctor/lens_change.hpp"
#include "fbvins/doctor/turn_fit.hpp"

namespace fbvins {

inline constexpr int kRegions = 3;  ///< of the image, along each side

/// Medians of the signed epipolar distance, px, by region of the left image, row by row.
using RegionErrors = std::array<double, kRegions * kRegions>;

struct StereoChange {
  FindingKind kind = FindingKind::right_camera_turned;
  WhichLens lens = WhichLens::right;  ///< whose lens, where it is a change of a lens
  Eigen::VectorXd amount;             ///< added to the calibration: rad, px, seconds, or logarithm of a factor
  Eigen::MatrixXd covariance;
  double explained_px = 0;  ///< root mean square of the epipolar error that it explains
};

struct StereoFit {
  int matches = 0;
  double error_px = 0;       ///< typical (1.48 median) epipolar error with the calibration
  double remaining_px = 0;   ///< after the changes
  RegionErrors regions{};    ///< with the calibration
  RegionErrors remaining{};  ///< after the changes
  std::vector<StereoChange> changes;
  StereoRig rig;  ///< the calibration with all changes; the baseline's length is not observable here
};

/// `imu`, if given and right, and the motions of `pairs` make a delay of the right image observable, as the rig moves meanwhile.
/// With `focal_known` the focal length that both lenses have in common is taken as right.
StereoFit fit_stereo(std::span<const StereoView> views, const StereoRig& rig, const ImuSeries* imu,
                     std::span<const FramePair> pairs, bool focal_known = false);

/// Typical (1.48 median) epipolar error of a view's matches with the calibration `rig`, px.
double epipolar_error_px(const StereoView& view, const StereoRig& rig);

}  // namespace fbvins
