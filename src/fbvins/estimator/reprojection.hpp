// SPDX-License-Identifier: Apache-2.0
// One landmark seen by one camera: residual and Jacobians (docs/derivations/window.md, W1-W8).
#pragma once

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

/// Camera-IMU calibration as a state.
struct Calibration {
  Pose<B, C0> T_BC0;
  Pose<B, C1> T_BC1;
  double time_offset_s = 0;  ///< t_imu = t_image + offset, beyond what the input has applied
};

/// How the body at the target frame sees what is given in the body at the host frame (W2):
/// p_Bt = R_th * x_h + rho * t_th, with x_h = R_BC0 * (alpha, beta, 1) + rho * t_BC0.
/// The *_first values are the same at first estimates; Jacobians are taken there (W9).
struct PairGeometry {
  Mat3 R_th, R_th_first;
  Mat3 R_t_first;  ///< R_WBt
  Vec3 t_th, t_th_first;

  void set(const Pose<W, B>& host, const Pose<W, B>& target) {
    const Mat3 R_tT = target.R().transpose();
    R_th.noalias() = R_tT * host.R();
    t_th.noalias() = R_tT * (host.p - target.p);
  }
  void set_first(const Pose<W, B>& host, const Pose<W, B>& target) {
    R_t_first = target.R();
    R_th_first.noalias() = R_t_first.transpose() * host.R();
    t_th_first.noalias() = R_t_first.transpose() * (host.p - target.p);
  }
};

/// Calibration unpacked once per evaluation.
struct CameraGeometry {
  Mat3 R_BC0;
  Vec3 t_BC0;
  Mat3 R_CB[2];   ///< left, right
  Vec3 t_BC[2];   ///< left, right
  double time_offset_s = 0;

  explicit CameraGeometry(const Calibration& calibration)
      : R_BC0(calibration.T_BC0.R()), t_BC0(calibration.T_BC0.p), time_offset_s(calibration.time_offset_s) {
    R_CB[0] = R_BC0.transpose();
    t_BC[0] = t_BC0;
    R_CB[1] = calibration.T_BC1.R().transpose();
    t_BC[1] = calibration.T_BC1.p;
  }
};

/// Landmarks closer to the image plane than this (scaled by inverse depth) have no projection.
inline constexpr double kMinScaledDepth = 1e-3;

}  // namespace fbvins
