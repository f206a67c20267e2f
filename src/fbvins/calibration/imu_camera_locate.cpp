// SPDX-License-Identifier: Apache-2.0
// The pose of a camera over a flat board: homography, then least squares in pixels (docs/derivations/calibration.md, A1).
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <cmath>
#include <limits>

#include "fbvins/calibration/imu_camera_start.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

constexpr int kSteps = 12;
constexpr double kHuber_px = 1.5;

struct Sighting {
  Vec3 p_T;
  Vec2 pixel, normalised;
};

/// From the homography of the board's plane, coordinates relative to the corners' centre.
std::optional<Pose<Cn, T>> pose_by_homography(const std::vector<Sighting>& seen) {
  Vec2 centre = Vec2::Zero();
  for (const Sighting& s : seen) centre += s.p_T.head<2>() / static_cast<double>(seen.size());
  double scale = 0;
  for (const Sighting& s : seen) scale += (s.p_T.head<2>() - centre).norm() / static_cast<double>(seen.size());
  if (!(scale > 0)) return std::nullopt;
  Eigen::Matrix<double, 9, 9> AtA = Eigen::Matrix<double, 9, 9>::Zero();
  for (const Sighting& s : seen) {
    const Vec2 xy = (s.p_T.head<2>() - centre) / scale;
    const Vec3 X(xy.x(), xy.y(), 1);
    Eigen::Matrix<double, 2, 9> row = Eigen::Matrix<double, 2, 9>::Zero();
    row.block<1, 3>(0, 0) = X.transpose(), row.block<1, 3>(0, 6) = -s.normalised.x() * X.transpose();
    row.block<1, 3>(1, 3) = X.transpose(), row.block<1, 3>(1, 6) = -s.normalised.y() * X.transpose();
    AtA += row.transpose() * row;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> eigen(AtA);
  if (!(eigen.eigenvalues()(1) > 1e-9 * eigen.eigenvalues()(8))) return std::nullopt;  // corners on a line
  const Eigen::Matrix<double, 9, 1> h = eigen.eigenvectors().col(0);
  Mat3 H;
  H << h.segment<3>(0).transpose(), h.segment<3>(3).transpose(), h.segment<3>(6).transpose();
  H.leftCols<2>() /= scale;
  const double size = std::sqrt(H.col(0).norm() * H.col(1).norm());
  if (!(size > 0)) return std::nullopt;
  H /= H(2, 2) < 0 ? -size : size;
  Mat3 R;
  R << H.col(0), H.col(1), H.col(0).cross(H.col(1));
  const Eigen::JacobiSVD<Mat3> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  R = svd.matrixU() * Vec3(1, 1, svd.matrixU().determinant() * svd.matrixV().determinant()).asDiagonal() * svd.matrixV().transpose();
  return Pose<Cn, T>(R, Vec3(H.col(2) - R.leftCols<2>() * centre));
}

/// Gauss-Newton steps in pixels; the cost, infinite where a corner comes behind the lens.
double refine(const Camera& camera, const std::vector<Sighting>& seen, Pose<Cn, T>& T_CT) {
  double cost = std::numeric_limits<double>::infinity();
  for (int step = 0; step <= kSteps; ++step) {
    Mat6 H = 1e-9 * Mat6::Identity();
    Vec6 b = Vec6::Zero();
    cost = 0;
    for (const Sighting& s : seen) {
      const Vec3 p_C = T_CT * s.p_T;
      const Vec2 n = p_C.head<2>() / p_C.z();
      if (!(p_C.z() > 1e-3) || !(n.norm() <= camera.max_normalised_radius())) return std::numeric_limits<double>::infinity();
      Mat2 D;
      const Vec2 r = camera.distort(n, &D) - s.pixel;
      const RobustValue robust = huber(r.squaredNorm(), kHuber_px);
      cost += robust.cost;
      Eigen::Matrix<double, 2, 3> J_point;
      J_point << D, -D * n;
      J_point /= p_C.z();
      Eigen::Matrix<double, 2, 6> J;
      J << J_point, -J_point * T_CT.R() * hat(s.p_T);
      H += robust.weight * J.transpose() * J;
      b += robust.weight * J.transpose() * r;
    }
    if (step == kSteps) break;
    const Vec6 x = -H.ldlt().solve(b);
    if (!x.allFinite() || x.tail<3>().norm() > 3) return std::numeric_limits<double>::infinity();
    T_CT = T_CT.boxplus(x.head<3>(), x.tail<3>());
    if (x.norm() < 1e-8) break;
  }
  return cost;
}

/// The pose whose perspective differs least: the board tilted the other way about the line of sight.
Pose<Cn, T> tilted_other_way(const Pose<Cn, T>& T_CT, const Vec3& centre_T) {
  const Vec3 centre_C = T_CT * centre_T, sight = centre_C.normalized(), normal = T_CT.q * Vec3::UnitZ();
  const Quat turn = so3_between(normal, 2 * normal.dot(sight) * sight - normal);
  const Quat q = (turn * T_CT.q).normalized();
  return {q, Vec3(centre_C - q * centre_T)};
}

}  // namespace

std::optional<SeenPose> locate(const Board& board, const Camera& camera, const BoardView& view, Time reference) {
  std::vector<Sighting> seen;
  Vec3 centre = Vec3::Zero();
  for (const BoardCorner& corner : view.corners)
    if (const std::optional<Vec2> n = camera.undistort(corner.pixel)) {
      seen.push_back({board.corner(corner.index), corner.pixel, *n});
      centre += seen.back().p_T;
    }
  if (seen.size() < kFewestCorners) return std::nullopt;
  centre /= static_cast<double>(seen.size());
  std::optional<Pose<Cn, T>> T_CT = pose_by_homography(seen);
  if (!T_CT) return std::nullopt;
  double cost = refine(camera, seen, *T_CT);
  Pose<Cn, T> other = tilted_other_way(*T_CT, centre);
  if (const double other_cost = refine(camera, seen, other); other_cost < cost) cost = other_cost, T_CT = other;
  if (!std::isfinite(cost)) return std::nullopt;
  const double freedom = 2.0 * static_cast<double>(seen.size()) - 6;
  return SeenPose{view.camera, (view.t - reference).seconds(), T_CT->inverse(), std::sqrt(2 * cost / freedom)};
}

}  // namespace fbvins
