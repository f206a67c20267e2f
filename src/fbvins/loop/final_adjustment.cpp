// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/final_adjustment.hpp"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <memory>
#include <set>

#include "fbvins/loop/feature_tracks.hpp"
#include "fbvins/loop/graph_costs.hpp"

namespace fbvins {
namespace {

constexpr double kNearest_m = 0.1;
constexpr int kMaxIterations = 25;  // of each of the two solves
/// Keyframes before it that each keyframe is matched with, and how far from where the map predicts it a match may be.
constexpr int kNeighbours = 3;
constexpr double kMatchRadius_px = 8;
/// Residual from which a sight counts less (Cauchy).
constexpr double kRobust_sigma = 2;
/// Sights farther than this from where the first solve puts them are wrong matches.
constexpr double kOutlier_sigma = 3.5;

/// (x, y, inverse depth) of a point of M in the camera of a keyframe, in standard deviations.
struct SightCost {
  Quat q_MB;
  Pose<B, C0> T_BC0;
  PlaceFeature seen;

  template <class T>
  bool operator()(const T* pose, const T* point, T* out) const {
    using V3 = Eigen::Matrix<T, 3, 1>;
    const V3 p_B = orientation<6>(q_MB, pose).conjugate() * V3(Eigen::Map<const V3>(point) - Eigen::Map<const V3>(pose));
    const V3 p_C = T_BC0.q.conjugate().cast<T>() * V3(p_B - T_BC0.p.cast<T>());
    if (p_C.z() < T(0.5 * kNearest_m)) return false;  // no step leads behind a camera
    const T rho = T(1) / p_C.z();
    out[0] = (p_C.x() * rho - T(seen.x)) / T(seen.sigma_xy);
    out[1] = (p_C.y() * rho - T(seen.y)) / T(seen.sigma_xy);
    out[2] = seen.has_depth() ? (rho - T(seen.inverse_depth)) / T(seen.sigma_inverse_depth) : T(0);
    return true;
  }
};

struct Sight {
  std::size_t keyframe, point;
  const PlaceFeature* feature;
};

/// All unknowns: six numbers a keyframe (position in M, turn about its orientation at the start) and three a point.
class Adjustment {
 public:
  explicit Adjustment(PlaceMap& map) : map_(map) {
    for (const MapKeyframe& k : map.keyframes()) poses_.push_back({k.T_MB.p.x(), k.T_MB.p.y(), k.T_MB.p.z(), 0, 0, 0});
  }

  void add_track(const FeatureTrack& track) {
    const std::optional<Vec3> p_M = first_point(track);
    if (!p_M) return;
    std::vector<Sight> sights;
    for (const FeatureView& view : track) {
      const PlaceFeature& f = map_.keyframes()[view.keyframe].place.features[view.feature];
      if (in_camera(view.keyframe, *p_M).z() > kNearest_m) sights.push_back({view.keyframe, points_.size(), &f});
    }
    if (sights.size() < 2) return;
    points_.push_back({p_M->x(), p_M->y(), p_M->z()});
    sights_.insert(sights_.end(), sights.begin(), sights.end());
  }

  bool empty() const { return sights_.empty(); }
  std::size_t points() const {
    std::set<std::size_t> seen;
    for (const Sight& s : sights_) seen.insert(s.point);
    return seen.size();
  }
  std::size_t sights() const { return sights_.size(); }

  int solve() {
    ceres::Problem problem;
    for (const Sight& s : sights_) {
      auto* cost = new ceres::AutoDiffCostFunction<SightCost, 3, 6, 3>(cost_of(s));
      problem.AddResidualBlock(cost, new ceres::CauchyLoss(kRobust_sigma), poses_[s.keyframe].data(), points_[s.point].data());
    }
    add_odometry(problem);
    add_gravity(problem);
    const auto first = std::find_if(poses_.begin(), poses_.end(), [&](auto& x) { return problem.HasParameterBlock(x.data()); });
    problem.SetParameterBlockConstant(first->data());
    const ceres::Solver::Options solver = repeatable_solver(ceres::SPARSE_SCHUR, kMaxIterations);
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    return summary.num_successful_steps;
  }

  void drop_outliers() {
    std::erase_if(sights_, [&](const Sight& s) {
      const auto r = residual(s, poses_, points_);
      return !r || r->norm() > kOutlier_sigma * std::sqrt(3.0);
    });
    std::vector<int> views(points_.size(), 0);
    for (const Sight& s : sights_) ++views[s.point];
    std::erase_if(sights_, [&](const Sight& s) { return views[s.point] < 2; });
  }

  /// Root of the mean squared distance in the image, over the sights there are now.
  double rms_px(bool at_start) const {
    double sum = 0;
    std::size_t count = 0;
    for (const Sight& s : sights_) {
      const auto r = residual(s, at_start ? start_poses_ : poses_, at_start ? start_points_ : points_);
      if (!r) continue;
      const double focal_px = map_.keyframes()[s.keyframe].place.focal_px;
      sum += (r->head<2>() * s.feature->sigma_xy * focal_px).squaredNorm();
      ++count;
    }
    return count == 0 ? 0 : std::sqrt(sum / static_cast<double>(count));
  }

  void remember_start() { start_poses_ = poses_, start_points_ = points_; }

  void write_back() {
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      MapKeyframe& k = map_.keyframes()[i];
      k.T_MB = {orientation<6>(k.T_MB.q, poses_[i].data()).normalized(), Vec3(poses_[i][0], poses_[i][1], poses_[i][2])};
    }
  }

 private:
  using PoseBlocks = std::vector<std::array<double, 6>>;
  using PointBlocks = std::vector<std::array<double, 3>>;

  SightCost* cost_of(const Sight& s) const { return new SightCost{map_.keyframes()[s.keyframe].T_MB.q, map_.T_BC0, *s.feature}; }

  Vec3 in_camera(std::size_t keyframe, const Vec3& p_M) const {
    return (map_.keyframes()[keyframe].T_MB * map_.T_BC0).inverse() * p_M;
  }

  std::optional<Vec3> first_point(const FeatureTrack& track) const {
    for (const FeatureView& view : track) {
      const MapKeyframe& k = map_.keyframes()[view.keyframe];
      const PlaceFeature& f = k.place.features[view.feature];
      if (f.has_point()) return k.T_MB * map_.T_BC0 * f.p_C0();
    }
    return std::nullopt;
  }

  std::optional<Vec3> residual(const Sight& s, const PoseBlocks& poses, const PointBlocks& points) const {
    const std::unique_ptr<SightCost> cost(cost_of(s));
    Vec3 r;
    return (*cost)(poses[s.keyframe].data(), points[s.point].data(), r.data()) ? std::optional(r) : std::nullopt;
  }

  /// The odometry between neighbours; a loop is in here as the points that both its ends see.
  void add_odometry(ceres::Problem& problem) {
    std::set<std::pair<std::size_t, std::size_t>> seen_together;
    for (std::size_t i = 1; i < sights_.size(); ++i)
      if (sights_[i].point == sights_[i - 1].point)
        seen_together.insert(std::minmax(sights_[i].keyframe, sights_[i - 1].keyframe));
    for (const MapEdge& e : map_.edges) {
      const auto a = static_cast<std::size_t>(map_.find(e.from) - map_.keyframes().data());
      const auto b = static_cast<std::size_t>(map_.find(e.to) - map_.keyframes().data());
      if (!map_.keyframes()[a].placed || !map_.keyframes()[b].placed) continue;
      const bool loop = e.kind == MapEdge::Kind::loop;
      if (loop && seen_together.contains(std::minmax(a, b))) continue;
      const Mat6 root = Eigen::LLT<Mat6>(e.information).matrixU();
      auto* cost = new ceres::AutoDiffCostFunction<EdgeCost<6>, 6, 6, 6>(
          new EdgeCost<6>{map_.keyframes()[a].T_MB.q, map_.keyframes()[b].T_MB.q, e.T_from_to, root});
      problem.AddResidualBlock(cost, loop ? new ceres::CauchyLoss(kRobust_sigma) : nullptr, poses_[a].data(), poses_[b].data());
    }
  }

  void add_gravity(ceres::Problem& problem) {
    constexpr double per_sigma = 1 / kTilt_rad;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      const MapKeyframe& k = map_.keyframes()[i];
      if (!problem.HasParameterBlock(poses_[i].data())) continue;
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<GravityCost, 2, 6>(
                                   new GravityCost{k.T_MB.q, k.T_WB.q.conjugate() * Vec3::UnitZ(), per_sigma}),
                               nullptr, poses_[i].data());
    }
  }

  PlaceMap& map_;
  PoseBlocks poses_, start_poses_;
  PointBlocks points_, start_points_;
  std::vector<Sight> sights_;
};

}  // namespace

FinalAdjustmentReport adjust_map(PlaceMap& map, const PlaceVerifierOptions& matching) {
  FinalAdjustmentReport report;
  if (map.empty()) return report;
  Adjustment adjustment(map);
  for (const FeatureTrack& track : feature_tracks(map, matching, kNeighbours, kMatchRadius_px)) adjustment.add_track(track);
  if (adjustment.empty()) return report;
  adjustment.remember_start();
  report.iterations = adjustment.solve();
  adjustment.drop_outliers();
  report.iterations += adjustment.solve();
  report.keyframes = static_cast<int>(map.size());
  report.points = static_cast<int>(adjustment.points());
  report.sights = static_cast<int>(adjustment.sights());
  report.initial_rms_px = adjustment.rms_px(true);
  report.final_rms_px = adjustment.rms_px(false);
  adjustment.write_back();
  return report;
}

}  // namespace fbvins
