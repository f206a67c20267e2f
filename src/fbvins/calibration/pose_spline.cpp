// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/pose_spline.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/geometry/bspline_basis.hpp"

namespace fbvins {
namespace {

constexpr int kSplineDegree = kSplineOrder - 1;

/// Weights of the control points in an interval, u in [0, 1], of positions and of rotations' steps (S2, S3).
struct Weights {
  std::array<double, kSplineOrder> p = {}, v = {}, a = {};
  std::array<double, kSplineOrder> step = {}, step_rate = {};  ///< of the step that leads to control point j; 0: unused
};

Weights weights(double u, double spacing_s) {
  const auto b5 = bspline_basis<kSplineDegree>(u);
  const auto b4 = bspline_basis<kSplineDegree - 1>(u);
  const auto b3 = bspline_basis<kSplineDegree - 2>(u);
  const auto at = [](const auto& b, int i) {
    return i < 0 || i >= static_cast<int>(b.size()) ? 0.0 : b[static_cast<std::size_t>(i)];
  };
  Weights w;
  double sum = 0;
  for (int j = kSplineDegree; j >= 0; --j) {
    const auto k = static_cast<std::size_t>(j);
    sum += b5[k];
    w.p[k] = b5[k];
    w.v[k] = (at(b4, j - 1) - at(b4, j)) / spacing_s;
    w.a[k] = (at(b3, j - 2) - 2 * at(b3, j - 1) + at(b3, j)) / (spacing_s * spacing_s);
    w.step[k] = sum;
    w.step_rate[k] = at(b4, j - 1) / spacing_s;
  }
  return w;
}

}  // namespace

PoseSpline::PoseSpline(double spacing_s, std::vector<Pose<T, B>> knots) : spacing_s_(spacing_s) { set_knots(std::move(knots)); }

void PoseSpline::set_knots(std::vector<Pose<T, B>> knots) {
  knots_ = std::move(knots);
  turns_.resize(knots_.size() - 1);
  inverse_jacobians_.resize(knots_.size() - 1);
  for (std::size_t i = 0; i + 1 < knots_.size(); ++i) {
    turns_[i] = so3_log(knots_[i].q.conjugate() * knots_[i + 1].q);
    inverse_jacobians_[i] = so3_right_jacobian_inverse(turns_[i]);
  }
}

int PoseSpline::interval(double t_s) const {
  return std::clamp(static_cast<int>(std::floor(t_s / spacing_s_)), 0, intervals() - 1);
}

SplineMotion PoseSpline::at(double t_s, SplineJacobian* J) const {
  const int first = interval(t_s);
  const Weights w = weights(t_s / spacing_s_ - first, spacing_s_);
  SplineMotion m;
  m.T_TB.q = knot(first).q;
  std::array<Mat3, kSplineOrder> R;            // of each step
  std::array<Vec3, kSplineOrder> rate_before;  // w before the step, turned by it
  for (int j = 0; j < kSplineOrder; ++j) {
    const auto k = static_cast<std::size_t>(j);
    const Vec3& p = knot(first + j).p;
    m.T_TB.p += w.p[k] * p;
    m.v_TB += w.v[k] * p;
    m.a_TB += w.a[k] * p;
    if (j == 0) continue;
    const Vec3& d = turn(first + j - 1);
    const Quat step = so3_exp(w.step[k] * d);
    m.T_TB.q = m.T_TB.q * step;
    R[k] = step.toRotationMatrix();
    rate_before[k] = R[k].transpose() * m.w_TB_B;
    m.w_TB_B = rate_before[k] + w.step_rate[k] * d;  // (S4)
  }
  m.T_TB.q.normalize();
  if (!J) return m;
  J->first = first;
  J->p = w.p, J->v = w.v, J->a = w.a;
  J->J_rate_delta[0].setZero();
  Mat3 after_T = Mat3::Identity();  // transpose of the product of the later steps
  for (int j = kSplineDegree; j > 0; --j) {
    const auto k = static_cast<std::size_t>(j);
    const Vec3& d = turn(first + j - 1);
    const Mat3& inverse = turn_jacobian(first + j - 1);
    const Mat3 right = w.step[k] * so3_right_jacobian(w.step[k] * d);
    const Mat3 theta_d = after_T * right;                                                             // (S5)
    const Mat3 rate_d = after_T * (w.step_rate[k] * Mat3::Identity() + hat(rate_before[k]) * right);  // (S6)
    const Mat3 theta_own = theta_d * inverse, rate_own = rate_d * inverse;                            // (S7)
    if (j == kSplineDegree) J->J_theta_delta[k] = theta_own, J->J_rate_delta[k] = rate_own;
    else J->J_theta_delta[k] += theta_own, J->J_rate_delta[k] += rate_own;
    J->J_theta_delta[k - 1] = -theta_d * inverse.transpose();
    J->J_rate_delta[k - 1] = -rate_d * inverse.transpose();
    after_T = after_T * R[k].transpose();
  }
  J->J_theta_delta[0] += after_T;
  return m;
}

}  // namespace fbvins
