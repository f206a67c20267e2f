// SPDX-License-Identifier: Apache-2.0
// Private to the doctor: errors of features predicted from image to image with the gyroscope's rotation, as a least-squares
// problem in changes of the setup. The unknowns: rotation (R_CB Exp(x), rad), time offset (s), gyroscope's bias (rad/s) and
// logarithm of its scale and of that of each axis, time from an image's first line to its last (s), and of the left lens
// logarithm of the focal length, principal point (px), radial coefficients. And what the gyroscope reads of a specific force,
// rad/s for each m/s^2.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/doctor/block_fit.hpp"
#include "fbvins/doctor/imu_series.hpp"
#include "fbvins/doctor/motion_fit.hpp"

namespace fbvins {

namespace doctor::motion {
enum : int {
  kRotation = 0,
  kTime = 3,
  kBias = 4,
  kScale = 7,
  kAxis = 8,
  kRolling = 11,
  kFocal = 12,
  kCentre = 13,
  kRadial = 15,
  kForce = 17,  ///< nine, row by row
  kUnknowns = 26
};

/// The setup of the start, changed by x; made once for all pairs.
struct Hypothesis {
  Camera camera;
  Mat3 R_CB;
  Duration offset;
  Vec3 bias, scale;
  Mat3 by_force;
  double rolling_s;

  Hypothesis(const MotionStart& start, const Eigen::VectorXd& x);
};
}  // namespace doctor::motion

/// A Fit of change_search.hpp. `imu` must outlive it. Each pair's translation is eliminated, and kept for the next step.
class MotionProblem {
 public:
  static constexpr double kAsGood = 1;

  /// Takes the pairs with readings around them, and of each at most some forty features.
  MotionProblem(const std::vector<FramePair>& pairs, const ImuSeries& imu, const MotionStart& start);

  std::size_t pairs() const { return pairs_.size(); }
  std::optional<BlockSolution> converge();
  /// Robust standard deviation of one coordinate of a residual, px.
  double typical_error() const;
  double capped_error() const;
  doctor::motion::Hypothesis hypothesis() const { return {start_, x}; }

  Eigen::VectorXd x;
  std::vector<int> free;

 private:
  BlockFit linearise();
  /// The share of a step with which the lens stays within the range of its model.
  double in_model(const Eigen::VectorXd& step) const;

  std::vector<FramePair> pairs_;
  const ImuSeries* imu_;
  MotionStart start_;
};

}  // namespace fbvins
