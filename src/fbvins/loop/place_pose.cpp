// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_pose.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/geometry/ldlt.hpp"
#include "fbvins/geometry/p3p.hpp"

namespace fbvins {
namespace {

/// Samples of three points tried at most, and the share of draws that may end without one good sample.
constexpr int kMaxSamples = 100;
constexpr double kMissedGoodSample = 1e-4;
/// RANSAC: matches below which nothing is tried, and which a pose must explain.
constexpr int kMinMatches = 6;
/// Largest reprojection error of an inlier of a sample at the finest scale.
constexpr double kInlier_px = 3.0;
/// Standard deviation of a keypoint of the finest scale, to which others are compared.
constexpr double kFinestKeypoint_px = 0.7;
/// A point nearer to the camera's plane than this is behind it.
constexpr double kNearestSeen_m = 0.05;
/// Refinement: residuals count less from here, and not at all from there.
constexpr double kHuber_sigma = 2.0, kGross_sigma = 10;
/// A match farther from the refined pose than this is an outlier; with depth its squared residual has a third row.
constexpr double kPoseOutlier_sigma = 3.4, kThreeRowsOverTwo = 1.25;
constexpr int kRefinements = 8;
/// Keeps the normal equations solvable; far below the information of one match.
constexpr double kDamping = 1e-6;
/// A step (m and rad together) this long has diverged, one this short has arrived.
constexpr double kDivergedStep = 5, kArrivedStep = 1e-6;

const PlaceFeature& at(const Place& place, int i) { return place.features[static_cast<std::size_t>(i)]; }

Vec3 measured(const PlaceFeature& f) { return {f.x, f.y, f.inverse_depth}; }
Vec3 variances(const PlaceFeature& f) {
  const double xy = f.sigma_xy, rho = f.sigma_inverse_depth;
  return {xy * xy, xy * xy, rho * rho};
}

/// One match: the point of the candidate as both views see it, (x, y, inverse depth), and the residual in the same of the query
/// (L3), which has 3 rows, or 2 where the query has no depth.
class MatchTerm {
 public:
  explicit MatchTerm(const PlaceFeature& candidate) : point(measured(candidate)) {}

  Vec3 point;
  Vec3 r = Vec3::Zero();
  Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
  Mat3 information = Mat3::Zero();  ///< zero where a row does not exist
  double chi2 = 0;

  /// With the pose at hand. False when the point is behind the query's camera.
  bool evaluate(const PlaceFeature& q, const PlaceFeature& c, const Mat3& R, const Vec3& t) {
    const Vec3 ray(point.x(), point.y(), 1), P = R * ray + point.z() * t;  // the point, times its inverse depth
    if (!(P.z() > kNearestSeen_m * point.z())) return false;
    const double iz = 1 / P.z();
    const Vec3 expected(P.x() * iz, P.y() * iz, point.z() * iz);
    Mat3 J_P;  // d(x, y, inverse depth)/dP
    J_P << iz, 0, -expected.x() * iz, 0, iz, -expected.y() * iz, 0, 0, -expected.z() * iz;
    J.leftCols<3>() = point.z() * J_P;
    J.rightCols<3>() = -J_P * R * hat(ray);
    A_.leftCols<2>() = J_P * R.leftCols<2>();
    A_.col(2) = J_P * t + Vec3(0, 0, iz);
    c_ = measured(c) - point, c_variances_ = variances(c);
    r = expected + A_ * c_ - measured(q);
    Mat3 S = A_ * c_variances_.asDiagonal() * A_.transpose();
    S.diagonal() += variances(q);
    information.setZero();
    if (q.has_depth()) {
      information = S.inverse();
    } else {
      r.z() = 0;
      information.topLeftCorner<2, 2>() = S.topLeftCorner<2, 2>().inverse().eval();
    }
    chi2 = r.dot(information * r);
    return true;
  }

  /// The point that fits both views best, after this step of the pose (L4).
  void follow(const Vec6& step) {
    const Vec3 left = r + J * step;
    point += c_ - c_variances_.asDiagonal() * (A_.transpose() * (information * left));
    point.z() = std::max(point.z(), 0.0);
  }

 private:
  Mat3 A_ = Mat3::Identity();  // d(r)/d(point)
  Vec3 c_ = Vec3::Zero(), c_variances_ = Vec3::Zero();
};

double chi2_gate(const PlaceFeature& q) {
  return kPoseOutlier_sigma * kPoseOutlier_sigma * (q.has_depth() ? kThreeRowsOverTwo : 1.0);
}

struct Sampler {
  const Place& query;
  const Place& candidate;
  std::vector<DescriptorMatch> usable;  // the candidate's side is a point

  int score(const Mat3& R, const Vec3& t) const {
    int n = 0;
    for (const DescriptorMatch& m : usable) {
      const PlaceFeature &q = at(query, m.a), &c = at(candidate, m.b);
      const Vec3 p = R * c.p_C0() + t;
      if (!(p.z() > kNearestSeen_m)) continue;
      const double dx = p.x() / p.z() - q.x, dy = p.y() / p.z() - q.y;
      const double limit =
          kInlier_px / query.focal_px * std::max(1.0, 0.5 * (1 + q.sigma_xy / (kFinestKeypoint_px / query.focal_px)));
      n += dx * dx + dy * dy < limit * limit;
    }
    return n;
  }
};

}  // namespace

double tilt_error_rad(const Place& query, const Place& candidate, const Mat3& R_qc) {
  const Vec3 carried = R_qc * candidate.up_C0;
  return std::atan2(carried.cross(query.up_C0).norm(), carried.dot(query.up_C0));
}

std::optional<CameraFromCamera> ransac_pose(const Place& query, const Place& candidate, std::span<const DescriptorMatch> matches,
                                            Rng& rng) {
  Sampler sampler{query, candidate, {}};
  for (const DescriptorMatch& m : matches)
    if (at(candidate, m.b).has_point()) sampler.usable.push_back(m);
  const auto n = static_cast<std::uint32_t>(sampler.usable.size());
  if (n < kMinMatches) return std::nullopt;
  std::optional<CameraFromCamera> best;
  int best_score = kMinMatches - 1, needed = kMaxSamples;
  for (int i = 0; i < needed; ++i) {
    std::array<Vec3, 3> rays, points;
    std::uint32_t pick[3];
    for (std::size_t k = 0; k < 3; ++k) {
      pick[k] = rng.below(n);
      const DescriptorMatch& m = sampler.usable[pick[k]];
      rays[k] = at(query, m.a).xy().homogeneous();
      points[k] = at(candidate, m.b).p_C0();
    }
    if (pick[0] == pick[1] || pick[0] == pick[2] || pick[1] == pick[2]) continue;
    for (const auto& [R, t] : solve_p3p(rays, points)) {
      if (tilt_error_rad(query, candidate, R) > kMaxTilt_rad) continue;  // before the costly count
      const int score = sampler.score(R, t);
      if (score <= best_score) continue;
      best_score = score;
      best = CameraFromCamera(R, t);
      const double w = static_cast<double>(score) / n;
      const double log_miss = std::log1p(-std::min(1 - 1e-12, w * w * w));
      // As a double: for a tiny share of inliers this is more than an int can hold.
      needed = static_cast<int>(std::min<double>(kMaxSamples, std::log(kMissedGoodSample) / log_miss + 1));
    }
  }
  return best;
}

RelativePose refine_pose(const Place& query, const Place& candidate, std::span<const DescriptorMatch> matches,
                         const CameraFromCamera& start) {
  RelativePose out;
  out.T_qc = start;
  struct Matched {
    const DescriptorMatch* match;
    MatchTerm term;
    bool in_view = false;
  };
  std::vector<Matched> terms;
  for (const DescriptorMatch& m : matches)
    if (at(candidate, m.b).has_point()) terms.push_back({&m, MatchTerm(at(candidate, m.b))});
  const auto evaluate = [&](Matched& m, const Mat3& R) {
    return m.in_view = m.term.evaluate(at(query, m.match->a), at(candidate, m.match->b), R, out.T_qc.p);
  };
  for (int iteration = 0; iteration < kRefinements; ++iteration) {
    const Mat3 R = out.T_qc.R();
    Mat6 H = Mat6::Zero();
    Vec6 b = Vec6::Zero();
    for (Matched& m : terms) {
      if (!evaluate(m, R)) continue;
      const double s = std::sqrt(m.term.chi2);
      const double weight = s <= kHuber_sigma ? 1 : (s > kGross_sigma ? 0 : kHuber_sigma / s);
      const Eigen::Matrix<double, 6, 3> JtW = weight * m.term.J.transpose() * m.term.information;
      H += JtW * m.term.J;
      b -= JtW * m.term.r;
    }
    H.diagonal().array() += kDamping;
    const Vec6 step = Ldlt<6>(H).solve(b);
    if (!step.allFinite() || step.norm() > kDivergedStep) return out;
    out.T_qc = out.T_qc.boxplus(step.head<3>(), step.tail<3>());
    for (Matched& m : terms)
      if (m.in_view) m.term.follow(step);
    if (step.norm() < kArrivedStep) break;
  }
  const Mat3 R = out.T_qc.R();
  for (Matched& m : terms) {
    const PlaceFeature& q = at(query, m.match->a);
    if (!evaluate(m, R) || m.term.chi2 > chi2_gate(q)) continue;
    out.inliers.push_back(*m.match);
    out.information += m.term.J.transpose() * m.term.information * m.term.J;
  }
  return out;
}

}  // namespace fbvins
