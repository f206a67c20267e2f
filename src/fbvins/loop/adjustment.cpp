// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/adjustment.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

constexpr double kNearest_m = 0.1;
constexpr int kMaxIterations = 25;  // of one solve
/// Scale of the Cauchy loss.
constexpr double kRobust_sigma = 2;
/// Observations of which the root mean square of the three rows exceeds this are wrong matches.
constexpr double kOutlier_sigma = 3.5;
/// An anchor that is farther than this from the map as the graph has it is wrong.
constexpr double kAnchorOutlier_sigma = 4;
/// One track in so many is held out.
constexpr std::size_t kHeldOut = 8;
/// Time over which the odometry's drift exceeds the scatter of single keyframes.
constexpr double kStretch_s = 3;
/// Weak prior on the biases at the start of a flight, at the odometry's estimates.
constexpr double kGyroBiasSigma_radps = 0.1, kAccelBiasSigma_mps2 = 1;

/// Biases at the first keyframe of a flight.
struct BiasCost {
  MotionBlock expected;
  template <class T>
  bool operator()(const T* motion, T* out) const {
    for (std::size_t k = 0; k < 6; ++k)
      out[k] = (motion[3 + k] - T(expected[3 + k])) / T(k < 3 ? kGyroBiasSigma_radps : kAccelBiasSigma_mps2);
    return true;
  }
};

MotionBlock motion_of(const MapKeyframe& k) {
  const Vec3 v = k.T_MB.q * (k.T_GB.q.conjugate() * k.motion.v_GB);
  const Vec3 &g = k.motion.bias.gyro_radps, &a = k.motion.bias.accel_mps2;
  return {v.x(), v.y(), v.z(), g.x(), g.y(), g.z(), a.x(), a.y(), a.z()};
}

ImuBias bias_of(const MotionBlock& m) { return {{m[3], m[4], m[5]}, {m[6], m[7], m[8]}}; }

std::shared_ptr<const Preintegration> linearised_at(const std::shared_ptr<const Preintegration>& imu, const ImuBias& bias) {
  if (!imu->needs_repropagation(bias)) return imu;
  auto anew = std::make_shared<Preintegration>(*imu);
  anew->repropagate(bias);
  return anew;
}

double cauchy(double squared) { return kRobust_sigma * kRobust_sigma * std::log1p(squared / (kRobust_sigma * kRobust_sigma)); }

}  // namespace

Adjustment::Adjustment(const PlaceMap& map) : map_(map), has_readings_(map.size(), false) {
  for (const MapKeyframe& k : map.keyframes()) {
    start_.poses.push_back({k.T_MB.p.x(), k.T_MB.p.y(), k.T_MB.p.z(), 0, 0, 0});
    start_.motions.push_back(motion_of(k));
  }
  for (const MapEdge& e : map.edges) {
    const auto a = static_cast<std::size_t>(map.find(e.from) - map.keyframes().data());
    const auto b = static_cast<std::size_t>(map.find(e.to) - map.keyframes().data());
    if (!keyframe(a).placed || !keyframe(b).placed) continue;
    steps_.push_back({a, b, &e});
    if (e.imu) has_readings_[a] = has_readings_[b] = true;
  }
  if (map.anchored) choose_anchors();
}

void Adjustment::add(const FeatureTrack& track) {
  const std::optional<PointBlock> point = first_point(track);
  if (!point) return;
  std::vector<Observation> observations;
  for (const FeatureView& view : track) {
    const MapKeyframe& k = keyframe(view.keyframe);
    const Vec3 p_C = map_.T_MC(k).inverse() * Vec3(point->data());
    if (p_C.z() > kNearest_m) observations.push_back({view.keyframe, start_.points.size(), &k.place.features[view.feature]});
  }
  if (observations.size() < 2) return;
  std::vector<Observation>& to = start_.points.size() % kHeldOut == kHeldOut - 1 ? held_out_ : observations_;
  to.insert(to.end(), observations.begin(), observations.end());
  start_.points.push_back(*point);
}

std::optional<PointBlock> Adjustment::first_point(const FeatureTrack& track) const {
  for (const FeatureView& view : track) {
    const MapKeyframe& k = keyframe(view.keyframe);
    const PlaceFeature& f = k.place.features[view.feature];
    if (!f.has_point()) continue;
    const Vec3 p = map_.T_MC(k) * f.p_C0();
    return PointBlock{p.x(), p.y(), p.z()};
  }
  return std::nullopt;
}

std::size_t Adjustment::points() const {
  std::set<std::size_t> seen;
  for (const Observation& s : observations_) seen.insert(s.point);
  return seen.size();
}

/// Those that fit the map as the graph has it; the others are wrong.
void Adjustment::choose_anchors() {
  for (const MapAnchor& anchor : map_.anchors) {
    const auto at = static_cast<std::size_t>(map_.find(anchor.keyframe) - map_.keyframes().data());
    const MapKeyframe& k = keyframe(at);
    const Mat6 L = tilt_error(anchor.measured, k.T_MB.q, map_.up_B(k), kTilt_rad);
    const Vec6 r = residual(anchor.measured, k.T_MB.q, k.T_MB.p);
    const double chi2 = r.dot(widened(anchor.measured.information, L) * r);
    if (k.placed && chi2 < kAnchorOutlier_sigma * kAnchorOutlier_sigma) anchors_.push_back({at, &anchor.measured});
  }
}

/// With the frame of the anchors as M, nothing is held; what they do not determine is expected to stay about where it is. M is
/// level then by definition.
void Adjustment::add_anchors(ceres::Problem& problem, AdjustmentState& x) const {
  const auto add = [&](std::size_t at, const PartialPose& measured, ceres::LossFunction* loss) {
    auto* cost = cost_function(AnchorCost<6>{keyframe(at).T_MB.q, measured, root_of(measured.information)});
    problem.AddResidualBlock(cost, loss, x.poses[at].data());
  };
  for (const Anchored& a : anchors_)
    if (problem.HasParameterBlock(x.poses[a.keyframe].data())) add(a.keyframe, *a.measured, new ceres::CauchyLoss(kRobust_sigma));
  for (std::size_t i = 0; i < x.poses.size(); ++i)
    if (problem.HasParameterBlock(x.poses[i].data()) && (i == 0 || keyframe(i).session != keyframe(i - 1).session))
      add(i, about_here(keyframe(i).T_MB), nullptr);
  hold_level(problem, x);
}

void Adjustment::hold_level(ceres::Problem& problem, AdjustmentState& x) {
  if (problem.HasParameterBlock(x.tilt.data())) problem.SetParameterBlockConstant(x.tilt.data());
}

double Adjustment::anchors_cost(const AdjustmentState& x) const {
  double sum = 0;
  int rows = 0;
  for (const Anchored& a : anchors_) {
    const Pose<M, B> T_MB = pose(x, a.keyframe);
    const Vec6 r = residual(*a.measured, T_MB.q, T_MB.p);
    sum += r.dot(a.measured->information * r);
    rows += static_cast<int>((a.measured->information.diagonal().array() > 0).count());
  }
  return rows == 0 ? 0 : sum / rows;
}

int Adjustment::solve(AdjustmentState& x, double drift) const {
  ceres::Problem problem;
  add_observations(problem, observations_, x);
  add_readings(problem, x);
  add_edges(problem, x, drift);
  add_verticals(problem, x);
  if (map_.anchored) add_anchors(problem, x);
  const auto first = std::find_if(x.poses.begin(), x.poses.end(), [&](auto& p) { return problem.HasParameterBlock(p.data()); });
  if (first == x.poses.end()) return 0;  // no pose is observed or in an edge
  if (!map_.anchored) problem.SetParameterBlockConstant(first->data());
  ceres::Solver::Options solver = repeatable_solver(ceres::SPARSE_SCHUR, kMaxIterations);
  // The points go first; they are many, and see one another only through keyframes.
  solver.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  std::vector<double*> blocks;
  problem.GetParameterBlocks(&blocks);
  std::set<double*> points;
  for (PointBlock& p : x.points) points.insert(p.data());
  for (double* block : blocks) solver.linear_solver_ordering->AddElementToGroup(block, points.contains(block) ? 0 : 1);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  return summary.num_successful_steps;
}

void Adjustment::add_observations(ceres::Problem& problem, const std::vector<Observation>& observations,
                                  AdjustmentState& x) const {
  for (const Observation& s : observations)
    problem.AddResidualBlock(new ObservationCost(cost_of(s)), new ceres::CauchyLoss(kRobust_sigma), x.poses[s.keyframe].data(),
                             x.points[s.point].data());
}

void Adjustment::add_readings(ceres::Problem& problem, AdjustmentState& x) const {
  std::uint32_t begun = std::numeric_limits<std::uint32_t>::max();
  for (const auto& [a, b, edge] : steps_) {
    if (!edge->imu) continue;
    problem.AddResidualBlock(
        new ImuCost(keyframe(a).T_MB.q, keyframe(b).T_MB.q, linearised_at(edge->imu, bias_of(x.motions[a])), map_.gravity_mps2),
        nullptr, x.poses[a].data(), x.motions[a].data(), x.poses[b].data(), x.motions[b].data(), x.tilt.data());
    if (std::exchange(begun, keyframe(a).session) != keyframe(a).session)
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<BiasCost, 6, 9>(new BiasCost{start_.motions[a]}), nullptr,
                               x.motions[a].data());
  }
}

/// Odometry edges stay beside the observations, because the odometry saw each point in every image and not in keyframes alone.
/// A loop whose ends share a track is in the problem by its points already.
void Adjustment::add_edges(ceres::Problem& problem, AdjustmentState& x, double drift) const {
  std::set<std::pair<std::size_t, std::size_t>> seen_together;
  for (std::size_t i = 1; i < observations_.size(); ++i)
    if (observations_[i].point == observations_[i - 1].point)
      seen_together.insert(std::minmax(observations_[i].keyframe, observations_[i - 1].keyframe));
  for (const auto& [a, b, edge] : steps_) {
    const bool loop = edge->kind == MapEdge::Kind::loop;
    if (loop && seen_together.contains(std::minmax(a, b))) continue;
    const Mat6 root = upper_cholesky(loop ? edge->information : Mat6(edge->information / drift));
    auto* cost = cost_function(EdgeCost<6>{keyframe(a).T_MB.q, keyframe(b).T_MB.q, edge->T_from_to, root});
    problem.AddResidualBlock(cost, loop ? new ceres::CauchyLoss(kRobust_sigma) : nullptr, x.poses[a].data(), x.poses[b].data());
  }
}

/// The vertical as the odometry estimated it, for keyframes whose readings are not kept.
void Adjustment::add_verticals(ceres::Problem& problem, AdjustmentState& x) const {
  constexpr double per_sigma = 1 / kTilt_rad;
  for (std::size_t i = 0; i < x.poses.size(); ++i) {
    if (!problem.HasParameterBlock(x.poses[i].data()) || has_readings_[i]) continue;
    const Vec3 up_B = map_.up_B(keyframe(i));
    problem.AddResidualBlock(cost_function(GravityCost{keyframe(i).T_MB.q, up_B, per_sigma}), nullptr, x.poses[i].data(),
                             x.tilt.data());
  }
  const bool levelled = std::find(has_readings_.begin(), has_readings_.end(), true) != has_readings_.end();
  if (!levelled && problem.HasParameterBlock(x.tilt.data())) problem.SetParameterBlockConstant(x.tilt.data());
}

void Adjustment::drop_outliers(const AdjustmentState& x) {
  std::erase_if(observations_, [&](const Observation& s) {
    const auto r = cost_of(s).residual(x.poses[s.keyframe], x.points[s.point]);
    return !r || r->norm() > kOutlier_sigma * std::sqrt(3.0);
  });
  std::vector<int> views(x.points.size(), 0);
  for (const Observation& s : observations_) ++views[s.point];
  std::erase_if(observations_, [&](const Observation& s) { return views[s.point] < 2; });
}

double Adjustment::rms_px(const AdjustmentState& x) const {
  double sum = 0;
  std::size_t count = 0;
  for (const Observation& s : observations_) {
    const auto r = cost_of(s).residual(x.poses[s.keyframe], x.points[s.point]);
    if (!r) continue;
    sum += (r->head<2>() * s.feature->sigma_xy * keyframe(s.keyframe).place.focal_px).squaredNorm();
    ++count;
  }
  return count == 0 ? 0 : std::sqrt(sum / static_cast<double>(count));
}

/// With the poses held, all other unknowns are fitted to them, so that poses alone are compared.
Plausibility Adjustment::judged(AdjustmentState x) const {
  ceres::Problem problem;
  add_observations(problem, held_out_, x);
  add_readings(problem, x);
  if (map_.anchored) hold_level(problem, x);
  for (PoseBlock& pose : x.poses)
    if (problem.HasParameterBlock(pose.data())) problem.SetParameterBlockConstant(pose.data());
  ceres::Solver::Summary summary;
  ceres::Solve(repeatable_solver(ceres::SPARSE_NORMAL_CHOLESKY, kMaxIterations), &problem, &summary);
  return {held_out_cost(x), imu_cost(x), anchors_cost(x), odometry_cost(x)};
}

double Adjustment::held_out_cost(const AdjustmentState& x) const {
  double sum = 0, degrees = 0;
  for (const Observation& s : held_out_) {
    const auto r = cost_of(s).residual(x.poses[s.keyframe], x.points[s.point]);
    sum += cauchy(r ? r->squaredNorm() : 9 * kOutlier_sigma * kOutlier_sigma);
    degrees += s.feature->has_depth() ? 3 : 2;
  }
  const std::size_t points =
      static_cast<std::size_t>(std::count_if(held_out_.begin(), held_out_.end(), [&](const Observation& s) {
        return &s == &held_out_[0] || s.point != (&s)[-1].point;
      }));
  degrees -= 3.0 * static_cast<double>(points);
  return degrees > 0 ? sum / degrees : 0;
}

double Adjustment::imu_cost(const AdjustmentState& x) const {
  double sum = 0;
  int steps = 0;
  for (const auto& [a, b, edge] : steps_) {
    if (!edge->imu) continue;
    const ImuCost cost(keyframe(a).T_MB.q, keyframe(b).T_MB.q, linearised_at(edge->imu, bias_of(x.motions[a])),
                       map_.gravity_mps2);
    const double* blocks[] = {x.poses[a].data(), x.motions[a].data(), x.poses[b].data(), x.motions[b].data(), x.tilt.data()};
    Vec15 r;
    cost.Evaluate(blocks, r.data(), nullptr);
    sum += r.squaredNorm(), ++steps;
  }
  constexpr int kRows = 15, kUnknowns = 9;  // of a step; its motion was fitted
  return steps == 0 ? 0 : sum / ((kRows - kUnknowns) * steps);
}

double Adjustment::odometry_cost(const AdjustmentState& x) const {
  double sum = 0;
  int steps = 0;
  for (const auto& [a, b, edge] : steps_) {
    if (edge->kind != MapEdge::Kind::odometry) continue;
    const Vec6 r = edge_residual(pose(x, a), pose(x, b), edge->T_from_to);
    sum += r.dot(edge->information * r), ++steps;
  }
  return steps == 0 ? 0 : sum / (6 * steps);
}

double Adjustment::drift_found(const AdjustmentState& x) const {
  double sum = 0;
  int stretches = 0;
  Pose<B, B> T;
  Mat6 covariance = Mat6::Zero();
  std::optional<std::size_t> begin, end;
  for (const auto& [a, b, edge] : steps_) {
    if (edge->kind != MapEdge::Kind::odometry) continue;
    if (end != a) begin = a, T = {}, covariance.setZero();
    covariance = compose_covariance(T, covariance, edge->T_from_to, inverted(edge->information));
    T = T * edge->T_from_to;
    end = b;
    if ((keyframe(b).t - keyframe(*begin).t).seconds() < kStretch_s) continue;
    const Vec6 r = edge_residual(pose(x, *begin), pose(x, b), T);
    sum += r.dot(Ldlt<6>(covariance).solve(r)), ++stretches;
    end.reset();
  }
  return stretches == 0 ? 1 : sum / (6 * stretches);
}

void Adjustment::write(const AdjustmentState& x, PlaceMap& map) const {
  for (std::size_t i = 0; i < x.poses.size(); ++i)
    map.keyframes()[i].T_MB = {orientation<6>(keyframe(i).T_MB.q, x.poses[i].data()).normalized(), Vec3(x.poses[i].data())};
  (void)map.turn(turn_of(x.tilt).conjugate(), map.keyframes()[0].T_MB.p);
  for (std::size_t i = 0; i < x.poses.size(); ++i)
    if (MapKeyframe& k = map.keyframes()[i]; has_readings_[i]) k.place.up_C0 = map.T_MC(k).q.conjugate() * Vec3::UnitZ();
}

}  // namespace fbvins
