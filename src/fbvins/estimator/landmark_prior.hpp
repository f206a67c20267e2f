// SPDX-License-Identifier: Apache-2.0
// The prior of a re-observed landmark, as a factor of the window (docs/derivations/known_landmarks.md, K1-K3).
#pragma once

#include "fbvins/estimator/reprojection.hpp"

namespace fbvins {

/// Position of a landmark when it left the window.
struct LandmarkPrior {
  Vec3 p_W = Vec3::Zero();                   ///< m
  Mat3 sqrt_information = Mat3::Identity();  ///< 1/m; of the position, in W, relative to the map around it
  std::int64_t anchor = 0;                   ///< number of KnownLandmarks' anchor with the common uncertainty of that map
};

/// The landmark in the body of its host, m (W1).
inline Vec3 point_in_host(const CameraGeometry& cameras, const WindowLandmark& l) {
  return scaled_point_in_host(cameras, l) / l.alpha_beta_rho.z();
}

/// Whitened distance from the prior (K1).
inline Vec3 landmark_prior_residual(const CameraGeometry& cameras, const Pose<W, B>& host, const WindowLandmark& l,
                                    const LandmarkPrior& prior) {
  return prior.sqrt_information * (host * point_in_host(cameras, l) - prior.p_W);
}

/// Derivatives of landmark_prior_residual (K2).
struct LandmarkPriorJacobian {
  using Mat36 = Eigen::Matrix<double, 3, 6>;
  Mat36 host;       ///< by the host's (p, theta)
  Mat3 point;       ///< by (alpha, beta, rho)
  Mat36 extrinsic;  ///< by the (p, theta) of the ray's camera in the body

  LandmarkPriorJacobian(const CameraGeometry& cameras, const Pose<W, B>& T_WB, const WindowLandmark& l,
                        const LandmarkPrior& prior) {
    const Mat3 R_WB = T_WB.R();
    const Mat3 SR_WB = prior.sqrt_information * R_WB, SR_WC = SR_WB * cameras.R_BC[l.right_ray];
    const double depth = 1.0 / l.alpha_beta_rho.z();
    const Vec3 p_C = depth * Vec3(l.alpha_beta_rho.x(), l.alpha_beta_rho.y(), 1);
    host << prior.sqrt_information, -SR_WB * hat(point_in_host(cameras, l));
    point << depth * SR_WC.leftCols<2>(), -depth * (SR_WC * p_C);
    extrinsic << SR_WB, -SR_WC * hat(p_C);
  }
};

}  // namespace fbvins
