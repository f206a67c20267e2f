// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/spline.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fbvins {

SplineTrajectory::SplineTrajectory(double knot_spacing_s, std::vector<Vec3> positions, std::vector<Quat> rotations)
    : dt_(knot_spacing_s), positions_(std::move(positions)), rotations_(std::move(rotations)) {
  assert(positions_.size() >= 6 && positions_.size() == rotations_.size() && dt_ > 0);
  for (std::size_t i = 0; i + 1 < rotations_.size(); ++i)
    steps_.push_back(so3_log(rotations_[i].conjugate() * rotations_[i + 1]));
}

SplineTrajectory::Place SplineTrajectory::place(double t_s) const {
  const double x = std::clamp(t_s, 0.0, duration_s()) / dt_;
  const auto last = static_cast<double>(positions_.size() - 6);
  const double first = std::min(std::floor(x), last);
  return {static_cast<std::size_t>(first), x - first};
}

// The m-th derivative of a B-spline is the B-spline of degree k - m over the m-th differences of its
// control points; for the cumulative form (Sommer et al., CVPR 2020) angular velocity and acceleration
// follow recursively from the five factors.
MotionState SplineTrajectory::at(double t_s) const {
  const auto [first, u] = place(t_s);
  const auto b5 = bspline_basis<5>(u);
  const auto b4 = bspline_basis<4>(u);
  const auto b3 = bspline_basis<3>(u);
  const auto b2 = bspline_basis<2>(u);
  MotionState m;

  std::array<Vec3, 6> c;
  std::copy_n(positions_.begin() + static_cast<std::ptrdiff_t>(first), 6, c.begin());
  for (int j = 0; j < 6; ++j) m.T_WB.p += b5[j] * c[j];
  const auto difference = [&c, this](int count) {
    for (int j = 0; j < count; ++j) c[j] = (c[j + 1] - c[j]) / dt_;
  };
  difference(5);
  for (int j = 0; j < 5; ++j) m.v_WB += b4[j] * c[j];
  difference(4);
  for (int j = 0; j < 4; ++j) m.a_WB += b3[j] * c[j];
  difference(3);
  for (int j = 0; j < 3; ++j) m.j_WB += b2[j] * c[j];

  Quat q = rotations_[first];
  for (int j = 1; j <= 5; ++j) {
    const Vec3& d = steps_[first + j - 1];
    double lambda = 0;
    for (int l = j; l <= 5; ++l) lambda += b5[l];
    const double rate = b4[j - 1] / dt_;
    const double older = j >= 2 ? b3[j - 2] : 0.0;
    const double newer = j <= 4 ? b3[j - 1] : 0.0;
    const double rate_change = (older - newer) / (dt_ * dt_);
    const Quat A = so3_exp(lambda * d);
    const Vec3 w = A.conjugate() * m.w_WB_B;
    m.dw_WB_B = A.conjugate() * m.dw_WB_B + w.cross(rate * d) + rate_change * d;
    m.w_WB_B = w + rate * d;
    q = q * A;
  }
  m.T_WB.q = q.normalized();
  return m;
}

Pose<W, B> SplineTrajectory::pose(double t_s) const {
  const auto [first, u] = place(t_s);
  const auto b = bspline_basis<5>(u);
  Vec3 p = Vec3::Zero();
  for (int j = 0; j < 6; ++j) p += b[j] * positions_[first + j];
  Quat q = rotations_[first];
  double lambda = 1 - b[0];
  for (int j = 1; j <= 5; ++j) {
    q = q * so3_exp(lambda * steps_[first + j - 1]);
    lambda -= b[j];
  }
  return {q.normalized(), p};
}

}  // namespace fbvins
