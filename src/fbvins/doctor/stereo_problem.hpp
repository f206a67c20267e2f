// SPDX-License-Identifier: Apache-2.0
// Private to the doctor: the epipolar errors of stereo matches as a least-squares problem in changes of the calibration. The
// unknowns: rotation of C1 (rad, about its axes), direction of the baseline (rad), left, right and both lenses (logarithm of the
// focal length, principal point in px, two radial coefficients), delay of the right image (s).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fbvins/doctor/block_fit.hpp"
#include "fbvins/doctor/evidence.hpp"
#include "fbvins/doctor/imu_series.hpp"
#include "fbvins/doctor/turn_fit.hpp"

namespace fbvins {

namespace doctor::stereo {
inline constexpr int kOfLens = 5;
enum : int {
  kTurn = 0,
  kBaseline = 3,
  kLeft = 5,
  kRight = kLeft + kOfLens,
  kBoth = kRight + kOfLens,
  kDelay = kBoth + kOfLens,
  kUnknowns
};
enum : int { kFocal = 0, kCentre = 1, kRadial = 3 };  // of a lens

struct Match {
  Vec2 left, right;
  int stretch;
  Vec3 rate_C1, change_C1;  ///< angular rate at the image, rad/s, and acceleration, rad/s^2
  Vec3 velocity_C1;         ///< of the right camera, in baselines per second
};

/// The views' matches, each with the right camera's motion where `imu` and `pairs` give it.
std::vector<Match> collect(std::span<const StereoView> views, const StereoRig& rig, const ImuSeries* imu,
                           std::span<const FramePair> pairs);

/// The rig changed by x, made once for all matches.
struct Hypothesis {
  Camera left, right;
  Mat3 R;  ///< R_C1C0
  Vec3 t;  ///< direction of p_C1C0
  double delay, focal;

  Hypothesis(const StereoRig& rig, const Eigen::VectorXd& x);
  std::optional<double> error_px(const Match& match) const;
  double error_px(const Vec2& ray_left, const Vec2& ray_right, const Match& match) const;
};

/// 1.48 times the median: a robust standard deviation.
double typical_error_px(std::span<const Match> matches, const Hypothesis& at);
}  // namespace doctor::stereo

/// The baseline p_C1C0 with its direction changed by two small angles, rad.
Vec3 turned_baseline(const Vec3& p_C1C0, const Eigen::Vector2d& amount);

/// A Fit of change_search.hpp. Rig and matches outlive it.
class StereoProblem {
 public:
  static constexpr double kAsGood = 0.97;

  StereoProblem(std::span<const doctor::stereo::Match> matches, const StereoRig& rig)
      : x(Eigen::VectorXd::Zero(doctor::stereo::kUnknowns)), matches_(matches), rig_(&rig) {}

  std::optional<BlockSolution> converge();
  bool plausible() const;
  /// Root mean square of the errors, each capped, so that wrong matches add the same to every hypothesis, px.
  double capped_error() const;
  doctor::stereo::Hypothesis hypothesis() const { return {*rig_, x}; }

  Eigen::VectorXd x;
  std::vector<int> free;

 private:
  BlockFit linearise() const;
  bool step_down(const Eigen::VectorXd& step, double& error);

  std::span<const doctor::stereo::Match> matches_;
  const StereoRig* rig_;
};

}  // namespace fbvins
