// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/motion_check.hpp"

#include <cmath>

#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

/// Standard deviations of the prediction between two images: of its rotation, and of its velocity.
constexpr double kRotationSigma_rad = 1e-3, kVelocitySigma_mps = 0.02;
/// A prediction that needs a larger correction is wrong; no track is rejected by it.
constexpr double kFurthest_sigma = 6;
/// Noise of a track, and the residual at which its weight has fallen to a quarter.
constexpr double kNoise_px = 0.4, kScale_px = 1.2;
constexpr int kIterations = 3;
/// (T4): a track with a larger residual is on a moving object.
constexpr double kMoving_px = 0.8;
/// No track is rejected where there are fewer, or where a smaller share of them agrees with the prediction, which is wrong then.
constexpr std::size_t kFewest = 20;
constexpr double kLeastShare = 0.25;

}  // namespace

/// (T1), (T2). J: derivative by a rotation and a translation of the motion, both in the camera now.
Vec2 MotionCheck::residual_px(const CameraMotion& motion, const Point& point, Jacobian* J) const {
  const Vec3 p = motion.R_ba * point.before.homogeneous() + point.inverse_depth * motion.p_ba;
  const Vec2 seen = p.head<2>() / p.z();
  if (J) {
    Eigen::Matrix<double, 2, 3> projection;
    projection << 1, 0, -seen.x(), 0, 1, -seen.y();
    const Eigen::Matrix<double, 2, 3> dr_dp = point.J_pixel_normalised * projection / p.z();
    J->leftCols<3>() = -dr_dp * hat(p);
    J->rightCols<3>() = dr_dp * point.inverse_depth;
  }
  return point.J_pixel_normalised * (seen - point.now);
}

/// (T5): a depth error of a pixel of disparity moves the track by as much for each baseline that the camera has moved.
double MotionCheck::noise_scale(const CameraMotion& motion) const {
  return std::sqrt(1 + motion.p_ba.squaredNorm() / (baseline_m_ * baseline_m_));
}

/// (T3): Gauss-Newton from the prediction, which is also the prior. The weights of the Geman-McClure loss leave out tracks that
/// are far from it. Nothing where the correction is implausibly large.
std::optional<CameraMotion> MotionCheck::corrected(const CameraMotion& predicted, double dt_s) const {
  const double shift_sigma_m = kVelocitySigma_mps * dt_s;
  const double scale_px = kScale_px * noise_scale(predicted), noise_px = kNoise_px * noise_scale(predicted);
  Vec6 prior;
  prior << Vec3::Constant(1 / (kRotationSigma_rad * kRotationSigma_rad)), Vec3::Constant(1 / (shift_sigma_m * shift_sigma_m));
  CameraMotion motion = predicted;
  Vec6 total = Vec6::Zero();
  for (int i = 0; i < kIterations; ++i) {
    Mat6 H = prior.asDiagonal();
    Vec6 g = prior.cwiseProduct(total);
    for (const Point& point : points_) {
      Jacobian J;
      const Vec2 r = residual_px(motion, point, &J);
      const double falling = 1 / (1 + r.squaredNorm() / (scale_px * scale_px));
      const double weight = falling * falling / (noise_px * noise_px);
      H += weight * J.transpose() * J;
      g += weight * J.transpose() * r;
    }
    const Vec6 step = -Ldlt<6>(H).solve(g);
    const Mat3 turn = so3_exp(step.head<3>()).toRotationMatrix();
    motion.R_ba = turn * motion.R_ba;
    motion.p_ba = turn * motion.p_ba + step.tail<3>();
    total += step;
  }
  if (total.dot(prior.cwiseProduct(total)) > kFurthest_sigma * kFurthest_sigma) return std::nullopt;
  return motion;
}

const std::vector<std::size_t>& MotionCheck::moving(const CameraMotion& predicted, double dt_s) {
  moving_.clear();
  if (!predicted.has_rotation || !predicted.has_translation || !(dt_s > 0) || points_.size() < kFewest) return moving_;
  const std::optional<CameraMotion> motion = corrected(predicted, dt_s);
  if (!motion) return moving_;
  const double moving_px = kMoving_px * noise_scale(*motion);
  for (std::size_t k = 0; k < points_.size(); ++k)
    if (!(residual_px(*motion, points_[k]).norm() < moving_px)) moving_.push_back(k);
  const auto following = static_cast<double>(points_.size() - moving_.size());
  if (following < kLeastShare * static_cast<double>(points_.size())) moving_.clear();
  return moving_;
}

}  // namespace fbvins
