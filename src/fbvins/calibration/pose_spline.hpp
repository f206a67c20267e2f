// SPDX-License-Identifier: Apache-2.0
// The IMU's path over the board as a function of time: a uniform cumulative B-spline of degree 5 on SO3 x R3 with analytic
// derivatives by its control points (docs/derivations/calibration.md, S1-S7). One owner changes it; const members: any thread.
//
//   PoseSpline path(0.02, knots);                        // seconds from knot to knot
//   SplineMotion m = path.at(1.234);                     // seconds from the start
//   SplineJacobian J;  path.at(1.234, &J);               // and what each of six control points does to it
#pragma once

#include <array>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/geometry/pose.hpp"

namespace fbvins {

struct SplineMotion {
  Pose<T, B> T_TB;
  Vec3 v_TB = Vec3::Zero();    ///< m/s, in T
  Vec3 a_TB = Vec3::Zero();    ///< m/s^2, in T
  Vec3 w_TB_B = Vec3::Zero();  ///< rad/s, in B
};

inline constexpr int kSplineOrder = 6;  ///< control points at work at any time

/// For control points first .. first + 5, each perturbed as R <- R Exp(delta), p <- p + dp.
struct SplineJacobian {
  int first = 0;
  std::array<Mat3, kSplineOrder> J_theta_delta;             ///< of the rotation, perturbed on the right
  std::array<Mat3, kSplineOrder> J_rate_delta;              ///< of w_TB_B
  std::array<double, kSplineOrder> p = {}, v = {}, a = {};  ///< d position, velocity, acceleration / dp: times the identity
};

class PoseSpline {
 public:
  /// At least six knots. Time 0 is the start of the interval of the first six.
  PoseSpline(double spacing_s, std::vector<Pose<T, B>> knots);

  double spacing_s() const { return spacing_s_; }
  int size() const { return static_cast<int>(knots_.size()); }
  int intervals() const { return size() - kSplineOrder + 1; }
  double duration_s() const { return intervals() * spacing_s_; }
  /// Times outside of [0, duration] belong to the first or last interval.
  int interval(double t_s) const;
  const Pose<T, B>& knot(int index) const { return knots_[static_cast<std::size_t>(index)]; }
  /// Log(R_i^-1 R_i+1), rad, and the inverse of its right Jacobian.
  const Vec3& turn(int index) const { return turns_[static_cast<std::size_t>(index)]; }
  const Mat3& turn_jacobian(int index) const { return inverse_jacobians_[static_cast<std::size_t>(index)]; }

  SplineMotion at(double t_s, SplineJacobian* J = nullptr) const;
  void set_knots(std::vector<Pose<T, B>> knots);
  const std::vector<Pose<T, B>>& knots() const { return knots_; }

 private:
  double spacing_s_;
  std::vector<Pose<T, B>> knots_;
  std::vector<Vec3> turns_;
  std::vector<Mat3> inverse_jacobians_;
};

}  // namespace fbvins
