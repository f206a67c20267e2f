// SPDX-License-Identifier: Apache-2.0
// The prior of a re-observed landmark, as a factor of the window (docs/derivations/known_landmarks.md, K1-K3).
#pragma once

#include "fbvins/estimator/reprojection.hpp"

namespace fbvins {

/// Position of a landmark when it left the window.
struct LandmarkPrior {
  Vec3 p_G = Vec3::Zero();                   ///< m
  Mat3 sqrt_information = Mat3::Identity();  ///< 1/m; of the position, in G, relative to the map around it
  std::int64_t map_uncertainty = 0;          ///< number of that of the map, common to all of its moment, in KnownLandmarks
};

/// The landmark in the body of its host, m (W1).
inline Vec3 point_in_host(const CameraGeometry& cameras, const WindowLandmark& l) {
  return scaled_point_in_host(cameras, l) / l.alpha_beta_rho.z();
}

/// Whitened distance from the prior (K1).
inline Vec3 landmark_prior_residual(const CameraGeometry& cameras, const Pose<G, B>& host, const WindowLandmark& l,
                                    const LandmarkPrior& prior) {
  return prior.sqrt_information * (host * point_in_host(cameras, l) - prior.p_G);
}

/// Derivatives of landmark_prior_residual (K2).
struct LandmarkPriorJacobian {
  using Mat36 = Eigen::Matrix<double, 3, 6>;
  Mat36 host;       ///< by the host's (p, theta)
  Mat3 point;       ///< by (alpha, beta, rho)
  Mat36 extrinsic;  ///< by the (p, theta) of the ray's camera in the body

  LandmarkPriorJacobian(const CameraGeometry& cameras, const Pose<G, B>& T_GB, const WindowLandmark& l,
                        const LandmarkPrior& prior) {
    const Mat3 R_GB = T_GB.R();
    const Mat3 SR_GB = prior.sqrt_information * R_GB, SR_GC = SR_GB * cameras.R_BC[l.camera];
    const double depth = 1.0 / l.alpha_beta_rho.z();
    const Vec3 p_C = depth * Vec3(l.alpha_beta_rho.x(), l.alpha_beta_rho.y(), 1);
    host << prior.sqrt_information, -SR_GB * hat(point_in_host(cameras, l));
    point << depth * SR_GC.leftCols<2>(), -depth * (SR_GC * p_C);
    extrinsic << SR_GB, -SR_GC * hat(p_C);
  }
};

}  // namespace fbvins
