// SPDX-License-Identifier: Apache-2.0
// One landmark seen by one camera: residual and Jacobians (docs/derivations/window.md, W1-W8).
#pragma once

#include <algorithm>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/ids.hpp"
#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/calibration.hpp"
#include "fbvins/types/gauge.hpp"

namespace fbvins {

/// Relative pose of the bodies at host and target frame, for points scaled by their inverse depth (W2):
/// p_Bt = R_th * x_h + rho * t_th, with x_h = R_BC * (alpha, beta, 1) + rho * t_BC
/// of the camera of the host that the ray belongs to.
/// The *_first values are the same at the linearisation points, where Jacobians are taken (W9).
struct PairGeometry {
  Mat3 R_th, R_th_first;
  Mat3 R_t_first;  ///< R_GBt
  Vec3 t_th, t_th_first;

  void set(const Pose<G, B>& host, const Pose<G, B>& target) {
    const Mat3 R_tT = target.R().transpose();
    R_th.noalias() = R_tT * host.R();
    t_th.noalias() = R_tT * (host.p - target.p);
  }
  void set_first(const Pose<G, B>& host, const Pose<G, B>& target) {
    R_t_first = target.R();
    R_th_first.noalias() = R_t_first.transpose() * host.R();
    t_th_first.noalias() = R_t_first.transpose() * (host.p - target.p);
  }
};

/// Calibration as matrices, computed once per evaluation.
struct CameraGeometry {
  Mat3 R_BC[kMostCameras], R_CB[kMostCameras];  // of those that the rig has
  Vec3 t_BC[kMostCameras];
  double time_offset_s = 0, line_delay_s = 0;

  explicit CameraGeometry(const Calibration& calibration)
      : time_offset_s(calibration.time_offset_s), line_delay_s(calibration.line_delay_s) {
    for (int i = 0; i < calibration.camera_count(); ++i) {
      const Pose<B, C0> T_BC = calibration.T_BC(i);
      R_BC[i] = T_BC.R();
      R_CB[i] = R_BC[i].transpose();
      t_BC[i] = T_BC.p;
    }
  }
};

/// Landmarks with a smaller depth than this (scaled by inverse depth) have no projection.
inline constexpr double kMinScaledDepth = 1e-3;

struct WindowObservation {
  int frame = 0;
  int camera = 0;
  Vec2 normalised = Vec2::Zero();
  Vec2 velocity = Vec2::Zero();  ///< d(normalised)/dt, 1/s; only used by time offset and line delay
  Mat2 sqrt_information = Mat2::Identity();
  double rows = 0;                     ///< Observation::rows
  Vec3 displacement_B = Vec3::Zero();  ///< Observation::displacement_B, at the current estimate
};

/// A point on the ray (alpha, beta, 1) of a camera of its host frame, the left one of its group, or the right one if that alone
/// saw it first, at inverse depth rho (W1).
struct WindowLandmark {
  LandmarkId id = {};  ///< in the sliding window
  int host = 0;
  int camera = 0;             ///< that the ray is of
  int first_observation = 0;  ///< its observations are consecutive, sorted by frame
  int observation_count = 0;
  Vec3 alpha_beta_rho = Vec3::Zero();
  int prior = -1;  ///< index into WindowProblem::landmark_priors of a re-observed one
};

/// Whether online calibration refines the place of a camera.
inline bool is_refined(int camera) { return camera < 2; }

/// Columns of the stacked Jacobian of one observation.
enum Column {
  kHost = 0,
  kTarget = 6,
  kPoint = 12,
  kResidual = 15,
  kExtrinsic0 = 16,
  kExtrinsic1 = 22,
  kTimeOffset = 28,
  kLineDelay = 29
};

/// The landmark in its host's body, scaled by its inverse depth (W2).
inline Vec3 scaled_point_in_host(const CameraGeometry& cameras, const WindowLandmark& l) {
  const Vec3& m = l.alpha_beta_rho;
  return cameras.R_BC[l.camera] * Vec3(m.x(), m.y(), 1) + m.z() * cameras.t_BC[l.camera];
}

/// Whitened residual (W5); false where there is no projection.
inline bool reproject(const CameraGeometry& cameras, const PairGeometry& pair, const Vec3& x_h, double rho,
                      const WindowObservation& o, Vec3& p_C, Vec2& r) {
  const Vec3 p_B = pair.R_th * x_h + rho * pair.t_th;
  p_C.noalias() = cameras.R_CB[o.camera] * (p_B - rho * (cameras.t_BC[o.camera] + o.displacement_B));
  if (p_C.z() < kMinScaledDepth) return false;
  const Vec2 expected = p_C.head<2>() / p_C.z();
  r = o.sqrt_information * (expected - o.normalised + (cameras.time_offset_s + o.rows * cameras.line_delay_s) * o.velocity);
  return true;
}

/// Adds J^T r of a residual r that is weighed (W6, W7), without forming J.
template <class OfFrame>
void add_gradient(const CameraGeometry& cameras, const PairGeometry& pair, const WindowLandmark& l, const Vec3& x_h,
                  const WindowObservation& o, const Vec3& p_C, const Vec2& r, OfFrame of_host, OfFrame of_target,
                  Vec3& of_point) {
  const double rho = l.alpha_beta_rho.z();
  const double iz = 1.0 / p_C.z();
  const Vec2 s = o.sqrt_information.transpose() * r;
  const Vec3 a = cameras.R_BC[o.camera] * Vec3(iz * s.x(), iz * s.y(), -iz * iz * s.dot(p_C.head<2>()));  // A^T r
  const Vec3 b = pair.R_th_first.transpose() * a;
  const Vec3 c = cameras.R_BC[l.camera].transpose() * b;
  of_point.x() += c.x();
  of_point.y() += c.y();
  of_point.z() += b.dot(cameras.t_BC[l.camera]) + a.dot(pair.t_th_first) - a.dot(cameras.t_BC[o.camera] + o.displacement_B);
  if (o.frame == l.host) return;
  const Vec3 p_B = pair.R_th_first * x_h + rho * pair.t_th_first;
  const Vec3 translation = rho * (pair.R_t_first * a);
  of_host.template head<3>() += translation;
  of_host.template tail<3>() += x_h.cross(b);
  of_target.template head<3>() -= translation;
  of_target.template tail<3>() += a.cross(p_B);
}

/// Fills the two rows of Jacobian and residual, unweighted (W6-W8). Same frame: the pose columns stay zero.
template <int Columns>
void fill_jacobian_rows(const CameraGeometry& cameras, const PairGeometry& pair, bool same_frame, const WindowLandmark& l,
                        const Vec3& x_h, const WindowObservation& o, const Vec3& p_C, const Vec2& r, double rows[2][Columns]) {
  const double rho = l.alpha_beta_rho.z();
  const double iz = 1.0 / p_C.z();
  Eigen::Matrix<double, 2, 3> J_projection;  // S * d(x/z, y/z) / d p_C
  J_projection.leftCols<2>() = iz * o.sqrt_information;
  J_projection.col(2).noalias() = -iz * iz * (o.sqrt_information * p_C.head<2>());
  const Eigen::Matrix<double, 2, 3> A = J_projection * cameras.R_CB[o.camera];
  const Vec3 p_B = pair.R_th_first * x_h + rho * pair.t_th_first;
  for (int k = 0; k < 2; ++k) {
    double* J = rows[k];
    std::fill(J, J + Columns, 0.0);
    const Vec3 a = A.row(k);
    const Vec3 b = pair.R_th_first.transpose() * a;
    if (!same_frame) {
      const Vec3 translation = rho * (pair.R_t_first * a);
      Eigen::Map<Vec3>(J + kHost) = translation;
      Eigen::Map<Vec3>(J + kHost + 3) = x_h.cross(b);
      Eigen::Map<Vec3>(J + kTarget) = -translation;
      Eigen::Map<Vec3>(J + kTarget + 3) = a.cross(p_B);
    }
    const Vec3 c = cameras.R_BC[l.camera].transpose() * b;
    J[kPoint] = c.x();
    J[kPoint + 1] = c.y();
    J[kPoint + 2] = b.dot(cameras.t_BC[l.camera]) + a.dot(pair.t_th_first) - a.dot(cameras.t_BC[o.camera] + o.displacement_B);
    J[kResidual] = r[k];
    if constexpr (Columns == 32) {
      const Vec3 m(l.alpha_beta_rho.x(), l.alpha_beta_rho.y(), 1);
      if (is_refined(l.camera)) {
        double* of_ray = J + kExtrinsic0 + 6 * l.camera;
        Eigen::Map<Vec3>{of_ray} = rho * b;
        Eigen::Map<Vec3>(of_ray + 3) = m.cross(c);
      }
      if (is_refined(o.camera)) {
        double* camera = J + kExtrinsic0 + 6 * o.camera;
        Eigen::Map<Vec3>{camera} -= rho * a;
        Eigen::Map<Vec3>(camera + 3) += Vec3(J_projection.row(k)).cross(p_C);
      }
      J[kTimeOffset] = o.sqrt_information.row(k).dot(o.velocity);
      J[kLineDelay] = o.rows * J[kTimeOffset];
    }
  }
}

}  // namespace fbvins
