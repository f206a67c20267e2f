// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_frame.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/geometry/ldlt.hpp"
#include "fbvins/loop/pose_graph.hpp"

namespace fbvins {
namespace {

/// What an odometry at rest drifts in a second, as standard deviations that grow with the root of time.
constexpr double kStandstill_m = 0.001, kStandstillYaw_rad = 0.01 * kDegree;

/// Way over which the error of a scale becomes another one: the landmarks of one window are left behind.
constexpr double kSameScale_m = 8;

/// The pose with this orientation that takes the body at `p` to p_MB.
template <class From>
Pose<M, From> frame_at(const Quat& q, const Vec3& p_MB, const Vec3& p) {
  return {q, Vec3(p_MB - q * p)};
}

double wrapped(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

}  // namespace

DriftVariance drift_over(const DriftOptions& o, double metres, double seconds) {
  const auto square = [](double x) { return x * x; };
  return {square(o.position_m) * metres + square(kStandstill_m) * seconds,
          square(o.yaw_rad) * metres + square(kStandstillYaw_rad) * seconds};
}

Quat about_z(double yaw_rad) { return {std::cos(0.5 * yaw_rad), 0, 0, std::sin(0.5 * yaw_rad)}; }

Pose<M, M> nearest_to(std::span<const Pose<M, B>> wanted, std::span<const Pose<M, B>> poses, double lever_m) {
  Vec3 wanted_sum = Vec3::Zero(), sum = Vec3::Zero();
  for (std::size_t i = 0; i < poses.size(); ++i) wanted_sum += wanted[i].p, sum += poses[i].p;
  const double n = static_cast<double>(std::max<std::size_t>(poses.size(), 1));
  double sine = 0, cosine = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Vec3 a = poses[i].p - sum / n, b = wanted[i].p - wanted_sum / n;
    const double turned = yaw_of(wanted[i].q * poses[i].q.conjugate());
    sine += a.x() * b.y() - a.y() * b.x() + lever_m * lever_m * std::sin(turned);
    cosine += a.x() * b.x() + a.y() * b.y() + lever_m * lever_m * std::cos(turned);
  }
  const Quat turn = about_z(std::atan2(sine, cosine));
  return {turn, Vec3((wanted_sum - turn * sum) / n)};
}

double yaw_of(const Quat& q) { return wrapped(2 * std::atan2(q.z(), q.w())); }

void MapFrame::put(double yaw_rad, const Vec3& p_MB) {
  yaw_rad_ = yaw_rad;
  T_MG_ = frame_at<G>(about_z(yaw_rad) * q_LG_, p_MB, body());
}

void MapFrame::level(const Quat& q_LG) {
  q_LG_ = q_LG;
  put(yaw_rad_, T_MG_ * body());
}

void MapFrame::reset(const Pose<M, G>& T_MG, double sigma_m, double sigma_rad) {
  put(yaw_of(T_MG.q * q_LG_.conjugate()), T_MG * body());
  P_ = Vec4(sigma_m * sigma_m, sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad).asDiagonal();
  scale_.with.setZero();
  known_ = true;
}

/// (L34) With sigma zero nothing changes.
void MapFrame::advance_scale(const Vec3& step_M, const Mat4& F, double sigma) {
  if (sigma <= 0) return;
  const double variance = sigma * sigma, stays = std::exp(-step_M.norm() / kSameScale_m);
  if (scale_.variance == 0) scale_.variance = variance;
  Vec4 by = Vec4::Zero();
  by.head<3>() = step_M;
  const Vec4 carried = F * scale_.with;
  P_ += carried * by.transpose() + by * carried.transpose() + scale_.variance * by * by.transpose();
  scale_.with = stays * (carried + scale_.variance * by);
  scale_.variance = stays * stays * scale_.variance + (1 - stays * stays) * variance;
}

void MapFrame::advance(const Pose<G, B>& T_GB, Time t, const DriftOptions& rate, double scale_sigma) {
  Vec3 longer = Vec3::Zero();
  if (last_ && known_) {
    const Vec3 step = T_GB.p - last_->T_GB.p;
    const DriftVariance drift = drift_over(rate, step.norm(), std::abs((t - last_->t).seconds()));
    Mat4 F = Mat4::Identity();  // a yaw error turns the step
    F.topRightCorner<3, 1>() = Vec3::UnitZ().cross(T_MG_.q * step);
    P_ = F * P_ * F.transpose();
    longer = (std::exp(scale_.log) - 1) * (T_MG_.q * step);
    advance_scale(T_MG_.q * step, F, scale_sigma);
    P_.diagonal() += Vec4(drift.position_m2, drift.position_m2, drift.position_m2, drift.yaw_rad2);
  }
  last_ = Stamped{t, T_GB};
  if (scale_.log != 0) put(yaw_rad_, T_MG_ * body() + longer);
}

Vec4 MapFrame::innovation(const MeasuredPose& seen) const {
  const Pose<M, B> predicted = T_MG_ * last_->T_GB;
  Vec4 v;
  v << seen.T_MB.p - predicted.p, yaw_of(seen.T_MB.q * predicted.q.conjugate());
  return v;
}

double MapFrame::mahalanobis2(const MeasuredPose& seen) const {
  const Vec4 v = innovation(seen);
  return v.dot(Ldlt<4>(P_ + seen.covariance).solve(v));
}

void MapFrame::update(const MeasuredPose& seen) {
  const Vec4 v = innovation(seen);
  const Mat4 S = P_ + seen.covariance;
  const Mat4 K = Ldlt<4>(S).solve(P_).transpose();
  const Vec4 d = K * v;
  const Mat4 A = Mat4::Identity() - K;
  P_ = A * P_ * A.transpose() + K * seen.covariance * K.transpose();
  if (scale_.variance > 0) {
    const Vec4 gain = Ldlt<4>(S).solve(scale_.with);
    scale_.log += gain.dot(v);
    scale_.variance -= gain.dot(scale_.with);
    scale_.with = A * scale_.with;
  }
  put(yaw_rad_ + d[3], T_MG_ * body() + d.head<3>());
}

MapFrame::Whitened MapFrame::innovation(const PartialPose& seen, const Pose<G, B>& T_GB) const {
  const Pose<M, B> T_MB = T_MG_ * T_GB;
  const Vec3 up_B = T_MB.q.conjugate() * Vec3::UnitZ();
  const Mat6 S = root_of(widened(seen.information, tilt_error(seen, T_MB.q, up_B, tilt_rad_)));
  Eigen::Matrix<double, 6, 4> H = Eigen::Matrix<double, 6, 4>::Zero();
  H.topLeftCorner<3, 3>().setIdentity();
  H.topRightCorner<3, 1>() = Vec3::UnitZ().cross(T_MB * seen.p_B - T_MG_ * body());
  H.bottomRightCorner<3, 1>() = up_B;
  return {-S * residual(seen, T_MB.q, T_MB.p), S * H};
}

double MapFrame::mahalanobis2(const PartialPose& seen, const Pose<G, B>& T_GB) const {
  const auto [v, H] = innovation(seen, T_GB);
  return v.dot(Ldlt<6>(H * P_ * H.transpose() + Mat6::Identity()).solve(v));
}

void MapFrame::update(const PartialPose& seen, const Pose<G, B>& T_GB) {
  const auto [v, H] = innovation(seen, T_GB);
  const Mat6 S = H * P_ * H.transpose() + Mat6::Identity();
  const Eigen::Matrix<double, 4, 6> K = Ldlt<6>(S).solve(Eigen::Matrix<double, 6, 4>(H * P_)).transpose();
  const Vec4 d = K * v;
  const Mat4 remains = Mat4::Identity() - K * H;
  P_ = remains * P_ * remains.transpose() + K * K.transpose();
  if (scale_.variance > 0) {
    const Vec6 gain = Ldlt<6>(S).solve(Vec6(H * scale_.with));
    scale_.log += gain.dot(v);
    scale_.variance -= gain.dot(H * scale_.with);
    scale_.with = remains * scale_.with;
  }
  put(yaw_rad_ + d[3], T_MG_ * body() + d.head<3>());
}

const Pose<M, W>& MapFrameFollower::follow(const Pose<M, W>& target, const Pose<W, B>& T_WB, Time t) {
  if (!last_) {
    T_MW_ = frame_at<W>(about_z(yaw_of(target.q)), target * T_WB.p, T_WB.p);
  } else {
    const double dt = std::abs((t - *last_).seconds());
    const Vec3 here = T_MW_ * T_WB.p, gap = target * T_WB.p - here;
    const double yaw = yaw_of(T_MW_.q), turn = wrapped(yaw_of(target.q) - yaw);
    const double reach = max_mps_ * dt, max_turn = max_radps_ * dt;
    const Vec3 step = gap.norm() > reach ? Vec3(gap * (reach / gap.norm())) : gap;
    T_MW_ = frame_at<W>(about_z(yaw + std::clamp(turn, -max_turn, max_turn)), here + step, T_WB.p);
  }
  last_ = t;
  return T_MW_;
}

}  // namespace fbvins
