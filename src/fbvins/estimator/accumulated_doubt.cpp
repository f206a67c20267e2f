// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/accumulated_doubt.hpp"

#include "fbvins/estimator/integrity_thresholds.hpp"

namespace fbvins {
namespace {

using namespace thresholds;

}  // namespace

void AccumulatedDoubt::add(const Pose<G, B>& predicted, const Vec3& turn_B, const Vec3& shift_G) {
  if (turn_G_.isZero(0)) where_G_ = predicted.p;
  const Vec3 turn_G = predicted.q * turn_B;
  turn_G_ += turn_G, shift_G_ += shift_G;
  turns_G_ += turn_G * turn_G.transpose(), shifts_G_ += shift_G * shift_G.transpose();
}

bool AccumulatedDoubt::large() const { return shift_G_.norm() >= kLarge_m || turn_G_.norm() >= kLarge_rad; }

Mat6 AccumulatedDoubt::covariance(const Pose<G, B>& T_GB) const {
  const Mat3 R_BG = T_GB.R().transpose();
  const Mat3 turns_G = turns();
  const Mat3 lever = hat(T_GB.p - where_G_);
  Mat6 out = Mat6::Zero();
  out.topLeftCorner<3, 3>() = shifts_G_ + shift_G_ * shift_G_.transpose() + lever * turns_G * lever.transpose();
  out.bottomRightCorner<3, 3>() = R_BG * turns_G * R_BG.transpose();
  return out;
}

Mat3 AccumulatedDoubt::velocity_covariance(const Vec3& v_GB) const { return hat(v_GB) * turns() * hat(v_GB).transpose(); }

}  // namespace fbvins
