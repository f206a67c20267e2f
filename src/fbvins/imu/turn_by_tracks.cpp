// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/turn_by_tracks.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "fbvins/geometry/ldlt.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

constexpr double kHuber_sigmas = 2;
/// What is assumed of parallax: that of each track differs from the mean by so many times the mean, which is more than in any
/// room, so that the mean counts only where parallax is small; none is larger than the second, rad.
constexpr double kDepths = 3, kMostParallax = 0.5;
/// Rows that are taken later have another parallax where the camera accelerates: by 3 m/s^2 at 3 m, standard deviation, 1/s^2.
constexpr double kParallaxGain = 1;
/// Rounds of reweighting, from nothing and from a parallax that was found before, and what ends them.
constexpr int kRounds = 4, kRoundsNear = 2;
constexpr double kSame_rad = 2e-5;

/// A track in the plane across the direction that the turn predicts. Everything lies in that plane, so no basis of it is needed.
struct Sight {
  Vec3 expected, off;  ///< without parallax, and what was seen beside it
  Vec3 by_line;        ///< of `off`, by the line delay
  double late_s;       ///< mean time of its rows after that of the middle row
  Vec3 normal;         ///< of the plane of both directions
  double variance;
};

/// `v`, seen when the camera was turned by so much since the middle row, in the axes of the middle row.
Vec3 at_middle_row(const Vec3& v, const Vec3& angle) {
  const Vec3 turned = angle.cross(v);
  return v + turned + 0.5 * angle.cross(turned);
}

Sight sight_of(const SeenTwice& track, const PredictedTurnOfPair& turn) {
  const Vec3 a = at_middle_row(track.a, turn.around_a.after(turn.line_delay_s * track.rows_a));
  const Vec3 b = at_middle_row(track.b, turn.around_b.after(turn.line_delay_s * track.rows_b));
  Sight s;
  s.expected = turn.R.transpose() * a;
  const auto across = [&](const Vec3& v) { return Vec3(v - s.expected * s.expected.dot(v)); };
  s.off = across(b);
  s.by_line =
      across(track.rows_b * turn.around_b.rate.cross(b) - turn.R.transpose() * (track.rows_a * turn.around_a.rate.cross(a)));
  s.late_s = 0.5 * turn.line_delay_s * (track.rows_a + track.rows_b);
  s.normal = s.expected.cross(b);
  s.variance = track.sigma * track.sigma;
  return s;
}

/// The covariance of a sight is that of a track, and kDepths times its shift along the shift: C^-1 = (I - along shift shift^T) /
/// variance.
struct Weighted {
  Vec3 shift, residual;
  double along, information;  ///< with the robust weight
};

Weighted weighted(const Sight& s, const Vec3& parallax) {
  Weighted w;
  w.shift = parallax - s.expected * s.expected.dot(parallax);
  w.residual = s.off + w.shift;
  w.along = kDepths * kDepths / (s.variance + kDepths * kDepths * w.shift.squaredNorm());
  const double part = w.residual.dot(w.shift), squared = w.residual.squaredNorm() - w.along * part * part;
  w.information = huber(squared / s.variance, kHuber_sigmas).weight / s.variance;
  return w;
}

/// One round of reweighted least squares.
Vec3 better_parallax(const std::vector<Sight>& sights, const Vec3& parallax) {
  Mat3 V = 1 / (kMostParallax * kMostParallax) * Mat3::Identity();
  Vec3 v = Vec3::Zero();
  for (const Sight& s : sights) {
    const Weighted w = weighted(s, parallax);
    V.diagonal().array() += w.information;
    V.noalias() -= w.information * s.expected * s.expected.transpose();
    V.noalias() -= w.information * w.along * w.shift * w.shift.transpose();
    v += w.information * (s.off - w.along * w.shift.dot(s.off) * w.shift);
  }
  return -Ldlt<3>(V).solve(v);
}

Vec3 fit_parallax(const std::vector<Sight>& sights, Vec3 parallax, int rounds) {
  for (int i = 0; i < rounds; ++i) {
    const Vec3 before = parallax;
    parallax = better_parallax(sights, parallax);
    if ((parallax - before).squaredNorm() < kSame_rad * kSame_rad) break;
  }
  return parallax;
}

/// Negative logarithm of the likelihood.
double unlikeliness(const std::vector<Sight>& sights, const Vec3& parallax) {
  double out = 0;
  for (const Sight& s : sights) {
    const Weighted w = weighted(s, parallax);
    const double part = w.residual.dot(w.shift);
    out += huber((w.residual.squaredNorm() - w.along * part * part) / s.variance, kHuber_sigmas).cost;
    out += 0.5 * std::log(1 + kDepths * kDepths * w.shift.squaredNorm() / s.variance);
  }
  return out;
}

/// Where parallax is large, its direction lies in the plane of both directions of every track: the least share of what noise
/// would spread the planes' normals by, and not the least spread, which is always along the view.
Vec3 by_planes(const std::vector<Sight>& sights) {
  Mat3 spread = Mat3::Zero(), by_noise = 1e-6 * Mat3::Identity();
  for (const Sight& s : sights) {
    const double normal2 = s.normal.squaredNorm() / s.variance, weight = 1 / std::max(1.0, normal2 / 25);
    spread.noalias() += weight / s.variance * s.normal * s.normal.transpose();
    by_noise.diagonal().array() += weight;
    by_noise.noalias() -= weight * s.expected * s.expected.transpose();
  }
  const Vec3 t = Eigen::GeneralizedSelfAdjointEigenSolver<Mat3>(spread, by_noise).eigenvectors().col(0).normalized();
  double along = 0, most = 1e-9;
  for (const Sight& s : sights) {
    const Vec3 by_t = t - s.expected * s.expected.dot(t);
    along -= by_t.dot(s.off), most += by_t.squaredNorm();
  }
  return along / most * t;
}

Vec3 best_parallax(const std::vector<Sight>& sights) {
  const Vec3 from_none = fit_parallax(sights, Vec3::Zero(), kRounds),
             from_planes = fit_parallax(sights, by_planes(sights), kRounds);
  if ((from_none - from_planes).norm() < kSame_rad) return from_none;
  return unlikeliness(sights, from_planes) < unlikeliness(sights, from_none) ? from_planes : from_none;
}

}  // namespace

TurnError turn_error(const std::vector<SeenTwice>& tracks, const PredictedTurnOfPair& turn, const std::optional<Vec3>& near) {
  std::vector<Sight> sights;
  sights.reserve(tracks.size());
  for (const SeenTwice& track : tracks) sights.push_back(sight_of(track, turn));
  TurnError out;
  out.parallax = near ? fit_parallax(sights, *near, kRoundsNear) : best_parallax(sights);
  // Eliminated are the parallax, and by how much that of later rows is another.
  Mat6 V = Mat6::Zero();
  V.diagonal() << Vec3::Constant(1 / std::pow(kMostParallax, 2)), Vec3::Constant(1 / std::pow(kParallaxGain * turn.dt_s, 2));
  Vec6 v = Vec6::Zero();
  Eigen::Matrix<double, 4, 6> X = Eigen::Matrix<double, 4, 6>::Zero();
  out.rows = -3;
  for (const Sight& s : sights) {
    const Weighted w = weighted(s, out.parallax);
    const Mat3 W = w.information * (Mat3::Identity() - w.along * w.shift * w.shift.transpose());
    const Mat3 W_across = W - w.information * s.expected * s.expected.transpose(), by_turn = -hat(s.expected);
    const Vec3 off = W * s.off, by_line = W * s.by_line;
    const Mat3 turned = by_turn.transpose() * W;
    out.A.topLeftCorner<3, 3>() += turned * by_turn;
    out.A.topRightCorner<3, 1>() += turned * s.by_line;
    out.A(3, 3) += s.by_line.dot(by_line);
    out.a.head<3>() += by_turn.transpose() * off;
    out.a(3) += s.by_line.dot(off);
    Eigen::Matrix<double, 4, 3> by_parallax;
    by_parallax << by_turn.transpose() * W_across, by_line.transpose();
    X.leftCols<3>() += by_parallax, X.rightCols<3>() += s.late_s * by_parallax;
    V.topLeftCorner<3, 3>() += W_across, V.topRightCorner<3, 3>() += s.late_s * W_across;
    V.bottomRightCorner<3, 3>() += s.late_s * s.late_s * W_across;
    v.head<3>() += off, v.tail<3>() += s.late_s * off;
    out.cost += s.off.dot(off);
    out.rows += s.variance * (2 * w.information - w.information * w.along * w.shift.squaredNorm());
  }
  out.A.bottomLeftCorner<1, 3>() = out.A.topRightCorner<3, 1>().transpose();
  V.bottomLeftCorner<3, 3>() = V.topRightCorner<3, 3>().transpose();
  const Ldlt<6> ldlt(V);
  const Eigen::Matrix<double, 6, 4, Eigen::RowMajor> X_transposed = X.transpose();
  out.A -= X * ldlt.solve(X_transposed);
  out.a -= X * ldlt.solve(v);
  out.cost -= v.dot(ldlt.solve(v));
  return out;
}

}  // namespace fbvins
