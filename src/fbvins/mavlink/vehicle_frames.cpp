// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mavlink/vehicle_frames.hpp"

#include "fbvins/types/motion_at.hpp"

namespace fbvins {
namespace {

const Quat kHalfTurnAboutX(0, 1, 0, 0);  // between z up and z down

Mat3 columns(const Vec3& x, const Vec3& y, const Vec3& z) {
  Mat3 R;
  R << x, y, z;
  return R;
}

/// Columns: the IMU's axes in forward-right-down.
Mat3 axes(ImuAxes imu_axes) {
  const Vec3 forward(1, 0, 0), right(0, 1, 0), down(0, 0, 1);
  switch (imu_axes) {
    case ImuAxes::frd: break;
    case ImuAxes::flu: return columns(forward, -right, -down);
    case ImuAxes::camera_fwd: return columns(right, down, forward);
    case ImuAxes::camera_down: return columns(right, -forward, down);
  }
  return columns(forward, right, down);
}

double heading_rad(const Quat& q) {
  const Mat3 R = q.toRotationMatrix();
  return std::atan2(R(1, 0), R(0, 0));
}

}  // namespace

Pose<BodyFrd, B> mounting(const MountingOptions& options) {
  const Quat turn =
      so3_exp(Vec3(0, 0, options.yaw_rad)) * so3_exp(Vec3(0, options.pitch_rad, 0)) * so3_exp(Vec3(options.roll_rad, 0, 0));
  return {Quat(turn * Quat(axes(options.imu_axes))).normalized(), Vec3(options.x_m, options.y_m, options.z_m)};
}

Pose<B, BaseLink> base_link(const MountingOptions& options) {
  const Pose<BaseLink, BodyFrd> T_base_frd{kHalfTurnAboutX, Vec3::Zero()};
  Pose<B, BaseLink> out = (T_base_frd * mounting(options)).inverse();
  if (out.q.w() < 0) out.q.coeffs() *= -1;  // of two that are the same rotation the usual one
  return out;
}

VehicleFrames::VehicleFrames(const MountingOptions& options)
    : origin_(options.local_frame), T_BF_(mounting(options).inverse()), T_LW_(kHalfTurnAboutX, Vec3::Zero()) {}

/// Places the local frame in a new W.
void VehicleFrames::begin(const Pose<W, BodyFrd>& T_WF) {
  if (origin_ == LocalOrigin::world || (origin_ == LocalOrigin::map && !last_)) return;
  const double wanted_rad = last_ ? heading_rad(last_->q) : 0.0;
  T_LW_.q = so3_exp(Vec3(0, 0, wanted_rad - heading_rad(kHalfTurnAboutX * T_WF.q))) * kHalfTurnAboutX;
  if (last_) T_LW_.p = last_->p - T_LW_.q * T_WF.p;
}

void VehicleFrames::take(const MapUpdate& update) {
  if (origin_ == LocalOrigin::map) map_.take(update);
}

std::optional<VehicleState> VehicleFrames::state(const Odometry& odometry) {
  const bool finite = odometry.T_WB.p.allFinite() && odometry.T_WB.q.coeffs().allFinite() && odometry.v_WB.allFinite() &&
                      odometry.w_WB_B.allFinite();
  if (!odometry.health.has_pose() || !finite) return std::nullopt;
  const MotionAt<BodyFrd> at = motion_at(T_BF_, odometry);
  if (reset_counter_ != odometry.reset_counter) {
    reset_counter_ = odometry.reset_counter;
    begin(at.T_WX);
  }
  if (const auto T_MW = map_.T_MW(odometry.reset_counter)) T_LW_ = Pose<LocalFrd, M>{kHalfTurnAboutX, Vec3::Zero()} * *T_MW;

  const Mat3 R_LW = T_LW_.R(), R_FW = at.T_WX.R().transpose();
  VehicleState state;
  state.T_LF = T_LW_ * at.T_WX;
  last_ = state.T_LF;
  state.v_LF_F = R_FW * at.v_WX;
  state.w_LF_F = at.w_WX_X;
  Mat6 to_L = Mat6::Zero();
  to_L.topLeftCorner<3, 3>() = R_LW;
  to_L.bottomRightCorner<3, 3>() = state.T_LF.R();
  state.pose_covariance = to_L * at.pose_covariance * to_L.transpose();
  state.velocity_covariance = R_FW * at.velocity_covariance * R_FW.transpose();
  state.health = odometry.health;
  state.reset_counter = reset_counter(odometry.reset_counter);
  return state;
}

}  // namespace fbvins
