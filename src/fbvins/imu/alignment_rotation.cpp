// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/alignment_rotation.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "fbvins/optim/dense_system.hpp"

namespace fbvins {
namespace {

constexpr int kIterations = 4;

struct Normal {
  Eigen::MatrixXd H;
  Eigen::VectorXd b;
  double cost = 0;
};

/// Unknowns: correction of each orientation (3 each), then the gyro bias. Eq. A7-A9.
Normal linearise(const std::vector<Pose<VisualWorld, B>>& poses, const std::vector<Quat>& R_VB, const Vec3& bias,
                 const std::vector<Preintegration>& between, const AlignmentOptions& o) {
  const int n = static_cast<int>(poses.size()), bg = 3 * n;
  Normal N{Eigen::MatrixXd::Zero(bg + 3, bg + 3), Eigen::VectorXd::Zero(bg + 3), 0};
  const double pose_weight = 1 / (o.pose_sigma_rad * o.pose_sigma_rad);
  for (int k = 0; k < n; ++k) {
    const Vec3 r = so3_log(poses[k].q.conjugate() * R_VB[k]);
    N.H.block<3, 3>(3 * k, 3 * k) += pose_weight * Mat3::Identity();  // Jr^-1(r) ~ I for residuals of the noise's size
    N.b.segment<3>(3 * k) -= pose_weight * r;
    N.cost += pose_weight * r.squaredNorm();
  }
  const double bias_weight = 1 / (o.gyro_bias_prior_radps * o.gyro_bias_prior_radps);
  N.H.block<3, 3>(bg, bg) += bias_weight * Mat3::Identity();
  N.b.segment<3>(bg) -= bias_weight * bias;
  N.cost += bias_weight * bias.squaredNorm();
  for (int k = 0; k + 1 < n; ++k) {
    const Quat q_ij = R_VB[k].conjugate() * R_VB[k + 1];
    const Vec3 r = so3_log(between[k].delta_q().conjugate() * q_ij);
    const Mat3 Jr_inv = so3_right_jacobian_inverse(r);
    const Mat3 covariance = between[k].covariance().block<3, 3>(nav::theta, nav::theta);
    const Mat3 weight = covariance.llt().solve(Mat3::Identity());
    Eigen::Matrix<double, 3, 9> J;
    J << -Jr_inv * q_ij.toRotationMatrix().transpose(), Jr_inv,
        -Jr_inv * so3_exp(r).toRotationMatrix().transpose() * between[k].J_theta_bg();
    const Eigen::Matrix<double, 9, 3> Jt_w = J.transpose() * weight;
    const Eigen::Matrix<double, 9, 9> H = Jt_w * J;
    const Eigen::Matrix<double, 9, 1> b = -(Jt_w * r);
    const int at[3] = {3 * k, 3 * k + 3, bg};
    for (int i = 0; i < 3; ++i) {
      N.b.segment<3>(at[i]) += b.segment<3>(3 * i);
      for (int j = 0; j < 3; ++j) N.H.block<3, 3>(at[i], at[j]) += H.block<3, 3>(3 * i, 3 * j);
    }
    N.cost += r.dot(weight * r);
  }
  return N;
}

}  // namespace

RotationAlignment align_rotations(const std::vector<Pose<VisualWorld, B>>& poses, std::vector<Preintegration>& between,
                                  const AlignmentOptions& options) {
  const int n = static_cast<int>(poses.size()), bg = 3 * n;
  RotationAlignment result;
  result.R_VB.reserve(poses.size());
  for (const auto& T_VB : poses) result.R_VB.push_back(T_VB.q);
  const auto repropagate = [&] {
    for (Preintegration& p : between) p.repropagate({result.gyro_bias_radps, p.linearisation_bias().accel_mps2});
  };
  repropagate();
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Normal N = linearise(poses, result.R_VB, result.gyro_bias_radps, between, options);
    const auto d = solve_symmetric(N.H, N.b);
    if (!d) return result;
    for (int k = 0; k < n; ++k) result.R_VB[k] = (result.R_VB[k] * so3_exp(d->segment<3>(3 * k))).normalized();
    result.gyro_bias_radps += d->segment<3>(bg);
    repropagate();
    if (d->norm() < 1e-9) break;
  }
  const Normal N = linearise(poses, result.R_VB, result.gyro_bias_radps, between, options);
  const auto covariance = invert_symmetric(N.H);
  if (!covariance) return result;
  const Eigen::VectorXd variance = covariance->diagonal();
  result.gyro_bias_sigma_radps = std::sqrt(variance.tail<3>().maxCoeff());
  for (int k = 0; k < n; ++k) result.sigma_rad.push_back(std::sqrt(variance.segment<3>(3 * k).maxCoeff()));
  // 3n pose and 3(n-1) gyro residuals and the prior, less 3n + 3 unknowns (eq. A10).
  result.rms = std::sqrt(N.cost / std::max(1, 3 * (n - 1)));
  result.solved = std::isfinite(result.rms);
  return result;
}

}  // namespace fbvins
