// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/pose_graph.hpp"

#include <ceres/problem.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "fbvins/geometry/ldlt.hpp"
#include "fbvins/loop/graph_costs.hpp"

namespace fbvins {
namespace {

constexpr int kMaxIterations = 12;  // of one solve
/// Residual of a loop beyond which it counts little; loops that count less than this are false.
constexpr double kLoopOutlier_sigma = 4.0, kRejectedWeight = 0.1;
/// Factor by which each round of graduated non-convexity reduces mu.
constexpr double kMuStep = 2.0;
/// Anchors may be off by the size of a building: beyond this they do not make mu larger, which would cost solves.
constexpr double kLargestChi2 = 1e4;
/// A loop that counts for nothing still keeps its block of the problem definite.
constexpr double kMinWeight = 1e-6;

template <int Dof>
void add_cost(ceres::Problem& problem, const PoseGraphEdge& e, const Mat6& information, const std::vector<Pose<M, B>>& poses,
              std::vector<std::array<double, 6>>& x, std::vector<PoseGraphScale>& scales) {
  const auto a = static_cast<std::size_t>(e.a), b = static_cast<std::size_t>(e.b);
  const Mat6 root = upper_cholesky(information);
  const EdgeCost<Dof> edge{poses[a].q, poses[b].q, e.T_ab, root};
  using Cost = ScaledEdgeCost<Dof>;
  double *const xa = x[a].data(), *const xb = x[b].data();
  if (!e.scale_a && !e.scale_b) {
    problem.AddResidualBlock(cost_function(edge), nullptr, xa, xb);
  } else if (e.scale_a && e.scale_b && *e.scale_a != *e.scale_b) {
    problem.AddResidualBlock(cost_function(Cost{edge, 0.5}, 2), nullptr, xa, xb, &scales[*e.scale_a].log,
                             &scales[*e.scale_b].log);
  } else {
    const double share = e.scale_a && e.scale_b ? 1 : 0.5;
    problem.AddResidualBlock(cost_function(Cost{edge, share}, 1), nullptr, xa, xb,
                             &scales[e.scale_a ? *e.scale_a : *e.scale_b].log);
  }
}

template <int Dof>
void add_cost(ceres::Problem& problem, const PoseGraphAnchor& anchor, const std::vector<Pose<M, B>>& poses,
              std::vector<std::array<double, 6>>& x) {
  const auto i = static_cast<std::size_t>(anchor.node);
  const double weight = anchor.certain ? 1 : std::max(anchor.weight, kMinWeight);
  const AnchorCost<Dof> cost{poses[i].q, anchor.measured, std::sqrt(weight) * anchor.root};
  problem.AddResidualBlock(cost_function(cost), nullptr, x[i].data());
}

/// Geman-McClure's weight of a squared residual (L11).
double weight_of(double chi2, double mu) {
  constexpr double c2 = kLoopOutlier_sigma * kLoopOutlier_sigma;
  const double s = mu * c2 / (chi2 + mu * c2);
  return s * s;
}

}  // namespace

Vec6 edge_residual(const Pose<M, B>& T_Ma, const Pose<M, B>& T_Mb, const Pose<B, B>& T_ab) {
  Vec6 r;
  const Quat e = T_ab.q.conjugate() * T_Ma.q.conjugate() * T_Mb.q;
  r << T_Ma.q.conjugate() * (T_Mb.p - T_Ma.p) - T_ab.p, (e.w() < 0 ? -2.0 : 2.0) * e.vec();
  return r;
}

int PoseGraph::add_node(const Pose<M, B>& T_MB, const Vec3& up_B, bool fixed) {
  poses_.push_back(T_MB);
  up_B_.push_back(up_B);
  fixed_.push_back(fixed);
  return static_cast<int>(poses_.size()) - 1;
}

double PoseGraph::chi2(const PoseGraphEdge& edge, const PoseGraphOptions& options) const {
  PoseGraphEdge e = edge;
  e.weight = 1;
  const Vec6 r = residual_of(e);
  return r.dot(weighted_information(e, options) * r);
}

/// At the present poses and scales, in the units of the edge: what two flights see together has a length between theirs.
Vec6 PoseGraph::residual_of(const PoseGraphEdge& e) const {
  const Pose<M, B>&a = poses_[static_cast<std::size_t>(e.a)], &b = poses_[static_cast<std::size_t>(e.b)];
  if (!e.scale_a && !e.scale_b) return edge_residual(a, b, e.T_ab);
  const double log_a = e.scale_a ? scales_[*e.scale_a].log : 0, log_b = e.scale_b ? scales_[*e.scale_b].log : 0;
  return edge_residual({a.q, Vec3::Zero()}, {b.q, Vec3(std::exp(-0.5 * (log_a + log_b)) * (b.p - a.p))}, e.T_ab);
}

/// With four degrees of freedom a node cannot tilt: the error of the odometry's roll and pitch is added to the covariance of
/// loops, in rotation and, times their length, in position (L9).
Mat6 PoseGraph::weighted_information(const PoseGraphEdge& e, const PoseGraphOptions& options) const {
  const double weight = e.loop ? std::max(e.weight, kMinWeight) : 1.0;
  if (!e.loop || options.degrees_of_freedom == 6) return weight * e.information;
  const double tilt = kTilt_rad;
  Mat6 cov = inverted(e.information);
  const Vec3& up = up_B_[static_cast<std::size_t>(e.b)];
  cov.topLeftCorner<3, 3>().diagonal().array() += tilt * tilt * e.T_ab.p.squaredNorm();
  cov.bottomRightCorner<3, 3>() += 2 * tilt * tilt * (Mat3::Identity() - up * up.transpose());
  const Mat6 information = inverted(cov);
  return weight * 0.5 * (information + information.transpose());
}

double PoseGraph::chi2(const PoseGraphAnchor& anchor) const {
  const Pose<M, B>& T_MB = poses_[static_cast<std::size_t>(anchor.node)];
  return (anchor.root * residual(anchor.measured, T_MB.q, T_MB.p)).squaredNorm();
}

/// As for loops (L9), the error of roll and pitch, which a node of four degrees of freedom cannot correct, is the measurement's.
Mat6 PoseGraph::information_of(const PoseGraphAnchor& anchor, const PoseGraphOptions& options) const {
  if (options.degrees_of_freedom == 6) return anchor.measured.information;
  const auto i = static_cast<std::size_t>(anchor.node);
  return widened(anchor.measured.information, tilt_error(anchor.measured, poses_[i].q, up_B_[i], kTilt_rad));
}

int PoseGraph::solve(const PoseGraphOptions& options, PoseGraphReport& report) {
  ceres::Problem problem;
  std::vector<std::array<double, 6>> x(poses_.size());
  std::vector<bool> used(poses_.size(), false);
  for (std::size_t i = 0; i < poses_.size(); ++i) x[i] = {poses_[i].p.x(), poses_[i].p.y(), poses_[i].p.z(), 0, 0, 0};
  for (const PoseGraphEdge& e : edges_) {
    if (options.degrees_of_freedom == 4) add_cost<4>(problem, e, weighted_information(e, options), poses_, x, scales_);
    else add_cost<6>(problem, e, weighted_information(e, options), poses_, x, scales_);
    used[static_cast<std::size_t>(e.a)] = used[static_cast<std::size_t>(e.b)] = true;
  }
  for (const PoseGraphAnchor& a : anchors_) {
    if (options.degrees_of_freedom == 4) add_cost<4>(problem, a, poses_, x);
    else add_cost<6>(problem, a, poses_, x);
    used[static_cast<std::size_t>(a.node)] = true;
  }
  for (PoseGraphScale& s : scales_) {
    if (!problem.HasParameterBlock(&s.log)) continue;
    problem.AddResidualBlock(cost_function(ScaleCost{1 / s.sigma}), nullptr, &s.log);
    if (s.fixed) problem.SetParameterBlockConstant(&s.log);
  }
  const double per_sigma = 1 / kTilt_rad;
  std::array<double, 2> level{0, 0};
  for (std::size_t i = 0; i < poses_.size() && options.degrees_of_freedom == 6; ++i)
    if (used[i] && !fixed_[i])
      problem.AddResidualBlock(cost_function(GravityCost{poses_[i].q, up_B_[i], per_sigma}), nullptr, x[i].data(), level.data());
  if (problem.HasParameterBlock(level.data())) problem.SetParameterBlockConstant(level.data());
  for (std::size_t i = 0; i < poses_.size(); ++i)
    if (used[i] && fixed_[i]) problem.SetParameterBlockConstant(x[i].data());
  const ceres::Solver::Options solver = repeatable_solver(ceres::SPARSE_NORMAL_CHOLESKY, kMaxIterations);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (!used[i] || fixed_[i]) continue;
    poses_[i].p = Vec3(x[i][0], x[i][1], x[i][2]);
    poses_[i].q =
        (options.degrees_of_freedom == 4 ? orientation<4>(poses_[i].q, x[i].data()) : orientation<6>(poses_[i].q, x[i].data()))
            .normalized();
  }
  if (report.solves++ == 0) report.initial_cost = summary.initial_cost;
  report.final_cost = summary.final_cost;
  return summary.num_successful_steps;
}

void PoseGraph::weigh(double mu, const PoseGraphOptions& options) {
  for (PoseGraphEdge& e : edges_)
    if (e.loop) e.weight = weight_of(chi2(e, options), mu);
  for (PoseGraphAnchor& a : anchors_)
    if (!a.certain) a.weight = weight_of(chi2(a), mu);
}

PoseGraphReport PoseGraph::optimise(const PoseGraphOptions& options) {
  PoseGraphReport report;
  for (PoseGraphAnchor& a : anchors_) a.root = root_of(information_of(a, options));
  double worst = 0;
  for (const PoseGraphEdge& e : edges_)
    if (e.loop) worst = std::max(worst, chi2(e, options));
  for (const PoseGraphAnchor& a : anchors_)
    if (!a.certain) worst = std::max(worst, std::min(kLargestChi2, chi2(a)));
  // mu large: nearly convex, every loop counts; mu = 1: Geman-McClure.
  double mu = std::max(1.0, 2 * worst / (kLoopOutlier_sigma * kLoopOutlier_sigma));
  for (;;) {
    weigh(mu, options);
    report.iterations += solve(options, report);
    if (mu <= 1.0) break;
    mu = std::max(1.0, mu / kMuStep);
  }
  weigh(1, options);
  for (const PoseGraphEdge& e : edges_) report.rejected += e.loop && e.weight < kRejectedWeight;
  for (const PoseGraphAnchor& a : anchors_)
    if (!a.certain) ++(a.weight < kRejectedWeight ? report.anchors_rejected : report.anchors);
  return report;
}

}  // namespace fbvins
