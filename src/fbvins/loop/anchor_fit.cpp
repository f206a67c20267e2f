// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/anchor_fit.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <set>

#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

constexpr double kCertain_m = 0.1, kCertain_rad = 1.5 * kDegree;
constexpr int kLeastAnchors = 3, kLeastKeyframes = 2;
constexpr double kLeastShare = 0.6;
constexpr double kUnfit_sigma = 4;
/// Of more anchors, so many are taken, evenly: to judge hypotheses, and to make them, of every two of which there is one.
constexpr std::size_t kMostJudges = 100, kMostInPairs = 24;
constexpr double kShortestBase_m = 0.5;
constexpr int kIterations = 8;

struct Placement {
  double yaw_rad = 0;
  Vec3 p_A = Vec3::Zero();  ///< of the centre
};

/// The anchors, whitened where that does not depend on the placement, about a centre.
class Judges {
 public:
  Judges(const std::vector<AnchoredPose>& poses, const Vec3& centre_X) : centre_(centre_X) {
    for (const AnchoredPose& pose : poses) {
      const Vec3 up_B = pose.q_XB.conjugate() * Vec3::UnitZ();
      // The lever arm is turned to A by an angle not known yet; for a tilt its length is what counts.
      const Mat6 L = tilt_error(pose.measured, pose.q_XB, up_B, pose.tilt_rad);
      all_.push_back({&pose, root_of(widened(pose.measured.information, L))});
    }
  }

  std::size_t size() const { return all_.size(); }
  const AnchoredPose& pose(std::size_t i) const { return *all_[i].pose; }

  Vec6 whitened(std::size_t i, const Placement& x, Eigen::Matrix<double, 6, 4>* J = nullptr) const {
    const auto& [pose, root] = all_[i];
    const Quat turn = about_z(x.yaw_rad), q_AB = turn * pose->q_XB;
    const Vec3 arm = turn * (pose->p_XB - centre_);
    if (J != nullptr) {
      J->setZero();
      J->topLeftCorner<3, 3>().setIdentity();
      J->topRightCorner<3, 1>() = Vec3::UnitZ().cross(arm + q_AB * pose->measured.p_B);
      J->bottomRightCorner<3, 1>() = q_AB.conjugate() * Vec3::UnitZ();
      *J = root * *J;
    }
    return root * residual(pose->measured, q_AB, Vec3(x.p_A + arm));
  }
  bool fits(std::size_t i, const Placement& x) const { return whitened(i, x).squaredNorm() < kUnfit_sigma * kUnfit_sigma; }

  const Vec3& centre() const { return centre_; }

 private:
  struct Judge {
    const AnchoredPose* pose;
    Mat6 root;
  };
  Vec3 centre_;
  std::vector<Judge> all_;
};

/// Indices of at most `most` of n, evenly.
std::vector<std::size_t> evenly(std::size_t n, std::size_t most) {
  std::vector<std::size_t> out;
  const std::size_t count = std::min(n, most);
  for (std::size_t k = 0; k < count; ++k) out.push_back(k * n / count);
  return out;
}

bool has_position(const AnchoredPose& a) { return (a.measured.information.diagonal().head<3>().array() > 0).all(); }
bool has_attitude(const AnchoredPose& a) { return (a.measured.information.diagonal().tail<3>().array() > 0).all(); }
Vec3 point_X(const AnchoredPose& a) { return a.p_XB + a.q_XB * a.measured.p_B; }

/// The placement with this heading that takes the anchor's point to where it is measured.
Placement placed(const AnchoredPose& a, double yaw_rad, const Vec3& centre) {
  return {yaw_rad, Vec3(a.measured.T_AB.p - about_z(yaw_rad) * (point_X(a) - centre))};
}

std::vector<Placement> hypotheses(const Judges& judges) {
  std::vector<Placement> out;
  std::vector<std::size_t> positions;
  for (std::size_t i = 0; i < judges.size(); ++i) {
    const AnchoredPose& a = judges.pose(i);
    if (has_position(a) && has_attitude(a))
      out.push_back(placed(a, yaw_of(a.measured.T_AB.q * a.q_XB.conjugate()), judges.centre()));
    if (has_position(a)) positions.push_back(i);
  }
  if (out.size() > kMostJudges) {
    std::vector<Placement> fewer;
    for (const std::size_t i : evenly(out.size(), kMostJudges)) fewer.push_back(out[i]);
    out = fewer;
  }
  const std::vector<std::size_t> chosen = evenly(positions.size(), kMostInPairs);
  for (std::size_t i = 0; i < chosen.size(); ++i)
    for (std::size_t j = i + 1; j < chosen.size(); ++j) {
      const AnchoredPose &a = judges.pose(positions[chosen[i]]), &b = judges.pose(positions[chosen[j]]);
      const Vec3 in_X = point_X(b) - point_X(a), in_A = b.measured.T_AB.p - a.measured.T_AB.p;
      if (in_X.head<2>().norm() < kShortestBase_m || in_A.head<2>().norm() < kShortestBase_m) continue;
      const double yaw = std::atan2(in_A.y(), in_A.x()) - std::atan2(in_X.y(), in_X.x());
      out.push_back(placed(a, yaw, judges.centre()));
    }
  return out;
}

/// Sum of squared residuals, none counted beyond the bound of an outlier.
double cost_of(const Judges& judges, const std::vector<std::size_t>& asked, const Placement& x) {
  double cost = 0;
  for (const std::size_t i : asked) cost += std::min(judges.whitened(i, x).squaredNorm(), kUnfit_sigma * kUnfit_sigma);
  return cost;
}

/// Gauss-Newton over the anchors that fit; the information of the result.
Mat4 refine(const Judges& judges, Placement& x) {
  Mat4 information = Mat4::Zero();
  for (int k = 0; k < kIterations; ++k) {
    information.setZero();
    Vec4 b = Vec4::Zero();
    for (std::size_t i = 0; i < judges.size(); ++i) {
      if (!judges.fits(i, x)) continue;
      Eigen::Matrix<double, 6, 4> J;
      const Vec6 r = judges.whitened(i, x, &J);
      information += J.transpose() * J;
      b -= J.transpose() * r;
    }
    const Vec4 step = Ldlt<4>(information).solve(b);
    if (!step.allFinite()) return Mat4::Zero();
    x.p_A += step.head<3>();
    x.yaw_rad += step[3];
  }
  return information;
}

}  // namespace

std::optional<AnchorFit> fit_anchors(const std::vector<AnchoredPose>& poses, const Vec3& p_X) {
  if (poses.size() < kLeastAnchors) return std::nullopt;
  const Judges judges(poses, p_X);
  const std::vector<std::size_t> asked = evenly(judges.size(), kMostJudges);
  std::optional<Placement> best;
  double least = 0;
  for (const Placement& x : hypotheses(judges))
    if (const double cost = cost_of(judges, asked, x); !best || cost < least) best = x, least = cost;
  if (!best) return std::nullopt;
  const Mat4 information = refine(judges, *best);
  const Eigen::SelfAdjointEigenSolver<Mat4> eigen(information);
  if (!(eigen.eigenvalues()[0] > 1e-9 * eigen.eigenvalues()[3])) return std::nullopt;
  AnchorFit fit;
  fit.covariance = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  std::set<KeyframeId> agreeing;
  for (std::size_t i = 0; i < judges.size(); ++i)
    if (judges.fits(i, *best)) ++fit.inliers, agreeing.insert(poses[i].keyframe);
  const bool agreed = fit.inliers >= kLeastAnchors && agreeing.size() >= kLeastKeyframes &&
                      fit.inliers >= kLeastShare * static_cast<double>(judges.size());
  const bool certain = fit.covariance.diagonal().head<3>().maxCoeff() < kCertain_m * kCertain_m &&
                       fit.covariance(3, 3) < kCertain_rad * kCertain_rad;
  if (!agreed || !certain) return std::nullopt;
  fit.q_AX = about_z(best->yaw_rad);
  fit.p_AX = best->p_A - fit.q_AX * p_X;
  return fit;
}

}  // namespace fbvins
