// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/board_pose.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "fbvins/calibration/corner_noise.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

using Mat9 = Eigen::Matrix<double, 9, 9>;

struct PointOnRay {
  Vec3 p_T;
  Vec3 ray_C;
};

/// Shift and scale of the board's plane that make the corners' coordinates about one.
struct PlaneScale {
  Vec2 centre = Vec2::Zero();
  double per_m = 1;
};

PlaneScale scale_of(const std::vector<PointOnRay>& points) {
  PlaneScale out;
  for (const PointOnRay& s : points) out.centre += s.p_T.head<2>() / static_cast<double>(points.size());
  double square = 0;
  for (const PointOnRay& s : points) square += (s.p_T.head<2>() - out.centre).squaredNorm();
  out.per_m = std::sqrt(static_cast<double>(points.size()) / std::max(square, 1e-12));
  return out;
}

/// H with ray ~ H (x, y, 1): the smallest singular vector of [ray]x H (x, y, 1) = 0. nullopt where corners lie in a line.
std::optional<Mat3> homography(const std::vector<PointOnRay>& points, const PlaneScale& scale) {
  Mat9 sum = Mat9::Zero();
  for (const PointOnRay& s : points) {
    const Vec2 xy = scale.per_m * (s.p_T.head<2>() - scale.centre);
    const Mat3 cross = hat(s.ray_C);
    Eigen::Matrix<double, 3, 9> A;
    A << cross * xy.x(), cross * xy.y(), cross;  // columns of H
    sum += A.transpose() * A;
  }
  const Eigen::SelfAdjointEigenSolver<Mat9> eigen(sum);
  if (!(eigen.eigenvalues()[1] > 1e-9 * eigen.eigenvalues()[8])) return std::nullopt;
  return Mat3(Eigen::Map<const Mat3>(Eigen::Matrix<double, 9, 1>(eigen.eigenvectors().col(0)).data()));
}

std::optional<Pose<Cn, T>> pose_of(Mat3 H, const PlaneScale& scale, const std::vector<PointOnRay>& points) {
  double ahead = 0;
  for (const PointOnRay& s : points) {
    const Vec2 xy = scale.per_m * (s.p_T.head<2>() - scale.centre);
    ahead += s.ray_C.dot(H * Vec3(xy.x(), xy.y(), 1)) > 0 ? 1 : -1;
  }
  if (ahead < 0) H = -H;
  const double length = 0.5 * (H.col(0).norm() + H.col(1).norm());
  if (!(length > 1e-9 * H.col(2).norm())) return std::nullopt;
  H /= length;
  Mat3 R;
  R << H.col(0), H.col(1), H.col(0).cross(H.col(1));
  const Eigen::JacobiSVD<Mat3> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  R = svd.matrixU() * svd.matrixV().transpose();
  if (!(R.determinant() > 0)) return std::nullopt;
  const Vec3 p = H.col(2) / scale.per_m - R * Vec3(scale.centre.x(), scale.centre.y(), 0);
  return Pose<Cn, T>(R, p);
}

/// Half the sum of Huber's loss with a bound of one pixel times `spread_px`; equations, if given, are filled.
double cost_of(const LensModel& lens, const Board& board, const std::vector<BoardCorner>& corners, const Pose<Cn, T>& T_CnT,
               double spread_px, Mat6* H, Vec6* b) {
  double cost = 0;
  const Mat3 R = T_CnT.R();
  for (const BoardCorner& corner : corners) {
    const Vec3 p_T = board.corner(corner.index);
    LensDerivatives d;
    const auto pixel = project_point(lens, T_CnT * p_T, H ? &d : nullptr);
    if (!pixel) {
      cost += 100 * spread_px * spread_px;
      continue;
    }
    const Vec2 r = *pixel - corner.pixel;
    const double size = r.norm(), weight = size <= spread_px ? 1 : spread_px / size;
    cost += size <= spread_px ? 0.5 * size * size : spread_px * (size - 0.5 * spread_px);
    if (!H) continue;
    Eigen::Matrix<double, 2, 6> J;
    J << d.point, -d.point * R * hat(p_T);
    *H += weight * J.transpose() * J;
    *b -= weight * J.transpose() * r;
  }
  return cost;
}

/// Levenberg-Marquardt; returns the cost.
double refine(const LensModel& lens, const Board& board, const std::vector<BoardCorner>& corners, double spread_px,
              Pose<Cn, T>& pose) {
  double lambda = 1e-4;
  double cost = cost_of(lens, board, corners, pose, spread_px, nullptr, nullptr);
  for (int i = 0; i < 20; ++i) {
    Mat6 H = Mat6::Zero();
    Vec6 b = Vec6::Zero();
    cost_of(lens, board, corners, pose, spread_px, &H, &b);
    bool better = false;
    double decrease = 0;
    for (int retry = 0; retry < 5 && !better; ++retry) {
      Mat6 damped = H;
      damped.diagonal() *= 1 + lambda;
      damped.diagonal().array() += 1e-12;
      const Vec6 step = Ldlt<6>(damped).solve(b);
      if (!step.allFinite()) return cost;
      const Pose<Cn, T> trial = pose.boxplus(step.head<3>(), step.tail<3>());
      const double next = cost_of(lens, board, corners, trial, spread_px, nullptr, nullptr);
      if ((better = next < cost)) {
        decrease = cost - next;
        cost = next;
        pose = trial;
        lambda = std::max(0.1 * lambda, 1e-9);
      } else {
        lambda *= 10;
      }
    }
    if (!better || decrease < 1e-8 * cost) break;
  }
  return cost;
}

double robust_rms(const LensModel& lens, const Board& board, const std::vector<BoardCorner>& corners, const Pose<Cn, T>& pose) {
  std::vector<double> sizes;
  for (const BoardCorner& corner : corners) {
    const auto pixel = project_point(lens, pose * board.corner(corner.index));
    sizes.push_back(pixel ? (*pixel - corner.pixel).norm() : 1e4);
  }
  return coordinate_noise(sizes);
}

/// The board tilted to the other side of the line of sight: nearly the same image when it is small.
Pose<Cn, T> tilted_back(const Pose<Cn, T>& pose, const Board& board, const std::vector<BoardCorner>& corners) {
  Vec3 centre_T = Vec3::Zero();
  for (const BoardCorner& corner : corners) centre_T += board.corner(corner.index) / static_cast<double>(corners.size());
  const Vec3 centre_C = pose * centre_T, sight = centre_C.normalized();
  const Vec3 normal = pose.q * Vec3::UnitZ(), other = 2 * normal.dot(sight) * sight - normal;
  Pose<Cn, T> out;
  out.q = (so3_between(normal, other) * pose.q).normalized();
  out.p = centre_C - out.q * centre_T;
  return out;
}

}  // namespace

std::optional<PosedBoard> find_board_pose(const Camera& camera, const Board& board, const std::vector<BoardCorner>& corners) {
  std::vector<PointOnRay> points;
  for (const BoardCorner& corner : corners)
    if (const auto n = camera.undistort(corner.pixel))
      points.push_back({board.corner(corner.index), Vec3(n->x(), n->y(), 1).normalized()});
  if (points.size() < 4 || 2 * points.size() < corners.size()) return std::nullopt;
  const PlaneScale scale = scale_of(points);
  const auto H = homography(points, scale);
  if (!H) return std::nullopt;
  auto pose = pose_of(*H, scale, points);
  if (!pose) return std::nullopt;
  constexpr double kSpread_px = 2;
  double cost = refine(camera.model(), board, corners, kSpread_px, *pose);
  Pose<Cn, T> other = tilted_back(*pose, board, corners);
  double other_cost = refine(camera.model(), board, corners, kSpread_px, other);
  if (other_cost < cost) std::swap(*pose, other), std::swap(cost, other_cost);
  return PosedBoard{*pose, robust_rms(camera.model(), board, corners, *pose), other, other_cost - cost};
}

}  // namespace fbvins
