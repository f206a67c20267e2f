// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_edges.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

/// Factor on the covariance of loops: there are many, and they are not quite independent of one another.
constexpr double kLoopInflation = 2.0;
/// The covariance of a loop between views this far apart is doubled, and grows with the square of the distance: what is seen from
/// afar changes little on the way, so that many loops in a row err alike (L38).
constexpr double kAlike_m = 0.7;
/// No loop is more certain than this.
constexpr double kLoopFloor_m = 0.006, kLoopFloor_rad = 0.10 * kDegree;
/// Nor is an odometry edge, as variances: two keyframes may have the same position.
constexpr double kOdometryFloor_m2 = 1e-6, kOdometryFloor_rad2 = 1e-8;

Mat6 symmetric(const Mat6& m) { return 0.5 * (m + m.transpose()); }

}  // namespace

double angle_between(const Quat& a, const Quat& b) { return 2 * std::acos(std::min(1.0, std::abs(a.dot(b)))); }

MapEdge odometry_edge(const MapKeyframe& from, const Pose<G, B>& T_GB, Time t, const DriftOptions& options) {
  const Pose<B, B> T = from.T_GB.inverse() * T_GB;
  const DriftVariance drift = drift_over(options, T.p.norm(), std::abs((t - from.t).seconds()));
  Mat6 information = Mat6::Zero();
  // Variance of yaw in all three: a step is short, and roll and pitch drift less, not more.
  information.diagonal().head<3>().setConstant(1 / (drift.position_m2 + kOdometryFloor_m2));
  information.diagonal().tail<3>().setConstant(1 / (drift.yaw_rad2 + kOdometryFloor_rad2));
  return {from.id, {}, T, information, MapEdge::Kind::odometry, nullptr};
}

/// T_BcBq with the covariance of (dp in the candidate's body, dtheta in the query's), from the cameras' T_qc.
MapEdge loop_edge(const Pose<B, C0>& T_BC_candidate, const Pose<B, C0>& T_BC_query, KeyframeId candidate,
                  const RelativePose& pose) {
  const CameraFromCamera& T_qc = pose.T_qc;
  const Pose<B, B> T_cq(T_qc.inverse().q, T_qc.inverse().p);  // of cameras, though the types say bodies: see the formulas
  Mat6 J = Mat6::Zero();
  J.topLeftCorner<3, 3>() = -T_qc.R().transpose();
  J.topRightCorner<3, 3>() = hat(T_cq.p);
  J.bottomRightCorner<3, 3>() = -T_qc.R();
  const Mat6 cov_cq = kLoopInflation * J * inverted(pose.information) * J.transpose();
  const Pose<B, B> T_BCc(T_BC_candidate.q, T_BC_candidate.p), T_CqB(T_BC_query.cast_frames<B, B>().inverse());
  Mat6 cov = compose_covariance(T_BCc, Mat6::Zero(), T_cq, cov_cq);
  cov = compose_covariance(T_BCc * T_cq, cov, T_CqB, Mat6::Zero());
  cov *= 1 + T_cq.p.squaredNorm() / (kAlike_m * kAlike_m);
  cov.diagonal().head<3>().array() += kLoopFloor_m * kLoopFloor_m;
  cov.diagonal().tail<3>().array() += kLoopFloor_rad * kLoopFloor_rad;
  return {candidate, {}, T_BCc * T_cq * T_CqB, symmetric(inverted(cov)), MapEdge::Kind::loop, nullptr};
}

MeasuredPose measured_pose(const MapKeyframe& from, const MapEdge& edge, double metre) {
  MeasuredPose seen;
  seen.T_MB = from.T_MB * Pose<B, B>(edge.T_from_to.q, Vec3(metre * edge.T_from_to.p));
  const Mat6 cov = inverted(edge.information);
  const Mat3 R = from.T_MB.R(), R_q = seen.T_MB.R();
  // Position in M and the rotation's part about M's z.
  Eigen::Matrix<double, 4, 6> J = Eigen::Matrix<double, 4, 6>::Zero();
  J.topLeftCorner<3, 3>() = R;
  J.bottomRightCorner<1, 3>() = R_q.row(2);
  seen.covariance = J * cov * J.transpose();
  seen.tilt_variance_rad2 = 0.5 * (cov.bottomRightCorner<3, 3>().trace() - seen.covariance(3, 3));
  return seen;
}

}  // namespace fbvins
