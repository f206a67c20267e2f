// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/pose_refinement.hpp"

#include "fbvins/geometry/ldlt.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

constexpr double kHuberSigma = 2.0;
constexpr double kMinDepth_m = 0.05;

struct PoseEquations {
  Mat6 H = Mat6::Zero();
  Vec6 g = Vec6::Zero();
  int inliers = 0;

  /// `t_BC`: of the camera where it saw this.
  void add(const Observation& o, const Vec3& p_B, const Mat3& R_CB, const Vec3& t_BC, const Mat3& R_BG) {
    const Vec3 p_C = R_CB * (p_B - t_BC);
    if (p_C.z() < kMinDepth_m) return;
    const double iz = 1.0 / p_C.z();
    const Vec2 r = o.sqrt_information * (iz * p_C.head<2>() - o.normalised);
    Eigen::Matrix<double, 2, 3> A;
    A.leftCols<2>() = iz * o.sqrt_information;
    A.col(2) = -iz * iz * (o.sqrt_information * p_C.head<2>());
    A = (A * R_CB).eval();
    Eigen::Matrix<double, 2, 6> J;
    J.leftCols<3>() = -A * R_BG;
    J.rightCols<3>() = A * hat(p_B);
    const double w = huber(r.squaredNorm(), kHuberSigma).weight;
    H += w * J.transpose() * J;
    g += w * J.transpose() * r;
    inliers += r.norm() < 3;
  }
};

}  // namespace

PoseRefinement refine_pose(const std::vector<LandmarkObservation>& observations, const Calibration& calibration, Pose<G, B> guess,
                           const Vec3& v_B, int max_iterations) {
  const CameraGeometry cameras(calibration);
  PoseRefinement out{guess, 0, false};
  for (int i = 0; i < max_iterations; ++i) {
    PoseEquations n;
    const Mat3 R_BG = out.T_GB.R().transpose();
    for (const LandmarkObservation& l : observations) {
      const Vec3 p_B = R_BG * (l.p_G - out.T_GB.p);
      int with_first = n.inliers;
      for (const Observation& o : l.feature->seen) {
        n.add(o, p_B, cameras.R_CB[o.camera], cameras.t_BC[o.camera] + o.displacement_B(v_B), R_BG);
        if (&o == l.feature->seen.begin()) with_first = n.inliers;
      }
      n.inliers = with_first;
    }
    out.inliers = n.inliers;
    const Ldlt<6> ldlt(n.H);
    if (!ldlt.succeeded() || !(ldlt.least_pivot() > 1e-9)) return out;
    const Vec6 step = -ldlt.solve(n.g);
    out.T_GB = out.T_GB.boxplus(step.head<3>(), step.tail<3>());
    if (step.lpNorm<Eigen::Infinity>() < 1e-6) {
      out.converged = true;
      break;
    }
  }
  out.converged = out.converged || out.inliers > 0;
  return out;
}

}  // namespace fbvins
