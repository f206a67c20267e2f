// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_verifier.hpp"

#include <algorithm>
#include <bitset>

namespace fbvins {
namespace {

/// First matching, by descriptors alone: best over second-best distance, and matches below which RANSAC is not tried.
constexpr double kMaxRatio = 0.9;
constexpr int kFewestMatches = 12;
/// Inliers of a first refinement below which RANSAC's pose is the better start.
constexpr std::size_t kMinRefined = 6;
/// Guided matching: radius times the scale of the keypoint, wider where the start is RANSAC's, and how often.
constexpr double kGuided_px = 8, kWidenedAfterRansac = 1.5;
constexpr int kRounds = 2;
/// A feature whose size differs by more than this factor from what it should look like now is another one.
constexpr double kMaxScaleRatio = 1.8;
constexpr double kNearestPoint_m = 0.1;
/// Inliers must lie in this many cells of the grid over the image.
constexpr int kSpreadGrid = 4, kMinCells = 5;
/// The other direction must find this share of the inliers needed, and the same pose to within this.
constexpr double kMutualShare = 0.5, kMutual_m = 0.1, kMutual_rad = 0.03;
constexpr std::uint64_t kSeed = 1;        // of RANSAC
constexpr int kFarthestBoosted_bit = 60;  // 97 % of true pairs, docs/experiments/booster.md

}  // namespace

PlaceVerifierOptions for_boosted(PlaceVerifierOptions options) {
  options.max_distance_bit = std::min(options.max_distance_bit, kFarthestBoosted_bit);
  return options;
}

void PlaceVerifier::set_query(const Place& query) {
  query_ = &query;
  low_ = Vec2::Constant(1e9), high_ = Vec2::Constant(-1e9);
  for (const PlaceFeature& f : query.features) low_ = low_.cwiseMin(f.xy()), high_ = high_.cwiseMax(f.xy());
  high_ += Vec2::Constant(1e-6);
  // Counting sort by cell.
  cell_begin_.assign(kColumns * kRows + 1, 0);
  by_cell_.resize(query.size());
  for (const PlaceFeature& f : query.features) ++cell_begin_[static_cast<std::size_t>(cell_of(f.x, f.y)) + 1];
  for (std::size_t i = 1; i < cell_begin_.size(); ++i) cell_begin_[i] += cell_begin_[i - 1];
  std::vector<std::int32_t> next(cell_begin_.begin(), cell_begin_.end() - 1);
  for (std::size_t i = 0; i < query.size(); ++i) {
    const auto cell = static_cast<std::size_t>(cell_of(query.features[i].x, query.features[i].y));
    by_cell_[static_cast<std::size_t>(next[cell]++)] = static_cast<std::int32_t>(i);
  }
}

int PlaceVerifier::cell_of(double x, double y) const {
  const int c = std::clamp(static_cast<int>((x - low_.x()) / (high_.x() - low_.x()) * kColumns), 0, kColumns - 1);
  const int r = std::clamp(static_cast<int>((y - low_.y()) / (high_.y() - low_.y()) * kRows), 0, kRows - 1);
  return r * kColumns + c;
}

std::optional<VerifiedPose> PlaceVerifier::verify(const Place& candidate) {
  auto found = one_way(candidate);
  if (!found) return std::nullopt;
  const bool confirmed = confirmed_by_other_way(candidate, found->pose.T_qc);
  last_ = *found;
  return confirmed ? found : std::nullopt;
}

bool PlaceVerifier::confirmed_by_other_way(const Place& candidate, const CameraFromCamera& T_qc) {
  const Place& query = *query_;
  set_query(candidate);
  (void)one_way(query);
  set_query(query);
  const CameraFromCamera difference = T_qc * last_.pose.T_qc;
  return static_cast<double>(last_.pose.inliers.size()) >= kMutualShare * options_.min_inliers &&
         difference.p.norm() < kMutual_m && so3_log(difference.q).norm() < kMutual_rad;
}

std::optional<VerifiedPose> PlaceVerifier::one_way(const Place& candidate) {
  last_ = {};
  if (query_ == nullptr || query_->size() == 0 || candidate.size() == 0) return std::nullopt;
  const auto matches = match_descriptors(query_->descriptors, candidate.descriptors,
                                         {.max_distance = options_.max_distance_bit, .max_ratio = kMaxRatio, .mutual = true});
  if (static_cast<int>(matches.size()) < kFewestMatches) return std::nullopt;
  Rng rng(kSeed);
  const auto start = ransac_pose(*query_, candidate, matches, rng);
  if (!start) return std::nullopt;
  const RelativePose rough = refine_pose(*query_, candidate, matches, *start);
  const bool better = rough.inliers.size() >= kMinRefined;
  return collect(candidate, better ? rough.T_qc : *start, kWidenedAfterRansac * kGuided_px);
}

std::optional<VerifiedPose> PlaceVerifier::verify(const Place& candidate, const PosePrediction& prediction) {
  last_ = {};
  if (query_ == nullptr || query_->size() == 0 || candidate.size() == 0) return std::nullopt;
  return collect(candidate, prediction.T_qc, prediction.radius_px);
}

std::optional<VerifiedPose> PlaceVerifier::collect(const Place& candidate, CameraFromCamera start, double radius_px) {
  for (int round = 0; round < kRounds; ++round) {
    match_guided(candidate, start, radius_px);
    if (static_cast<int>(guided_.size()) < options_.min_inliers / 2) return std::nullopt;
    RelativePose pose = refine_pose(*query_, candidate, guided_, start);
    start = pose.T_qc;
    radius_px = std::min(radius_px, kGuided_px);
    judge(candidate, std::move(pose));
    if (static_cast<int>(last_.pose.inliers.size()) < options_.min_inliers / 2) return std::nullopt;
  }
  return accepted() ? std::optional(last_) : std::nullopt;
}

/// Each point of the candidate is searched for around where it should be; of points that match the same feature the most
/// similar keeps it.
void PlaceVerifier::match_guided(const Place& candidate, const CameraFromCamera& T_qc, double radius_px) {
  const Mat3 R = T_qc.R();
  const Vec2 cell((high_.x() - low_.x()) / kColumns, (high_.y() - low_.y()) / kRows);
  best_of_query_.assign(query_->size(), {-1, -1, 1 << 20});
  visible_ = 0;
  for (std::size_t j = 0; j < candidate.size(); ++j) {
    const PlaceFeature& c = candidate.features[j];
    if (!c.has_point()) continue;
    const Vec3 p = R * c.p_C0() + T_qc.p;
    if (!(p.z() > kNearestPoint_m)) continue;
    const Vec2 at = p.hnormalized();
    if ((at - low_).minCoeff() < 0 || (high_ - at).minCoeff() < 0) continue;
    ++visible_;
    // How large the feature should look now: the descriptor was cut at the level of its scale.
    const double sigma_expected = c.sigma_xy / (p.z() * c.inverse_depth);
    const double reach = radius_px / query_->focal_px;
    const int c0 = std::max(0, static_cast<int>((at.x() - reach - low_.x()) / cell.x())),
              c1 = std::min(kColumns - 1, static_cast<int>((at.x() + reach - low_.x()) / cell.x()));
    const int r0 = std::max(0, static_cast<int>((at.y() - reach - low_.y()) / cell.y())),
              r1 = std::min(kRows - 1, static_cast<int>((at.y() + reach - low_.y()) / cell.y()));
    int best = -1, first = options_.max_distance_bit + 1;
    for (int r = r0; r <= r1; ++r)
      for (std::int32_t k = cell_begin_[static_cast<std::size_t>(r * kColumns + c0)];
           k < cell_begin_[static_cast<std::size_t>(r * kColumns + c1) + 1]; ++k) {
        const auto i = static_cast<std::size_t>(by_cell_[static_cast<std::size_t>(k)]);
        const PlaceFeature& q = query_->features[i];
        if ((q.xy() - at).squaredNorm() > reach * reach) continue;
        if (q.sigma_xy > kMaxScaleRatio * sigma_expected || sigma_expected > kMaxScaleRatio * q.sigma_xy) continue;
        const int d = hamming_distance(query_->descriptors[i], candidate.descriptors[j]);
        if (d < first) first = d, best = static_cast<int>(i);
      }
    if (best < 0) continue;
    DescriptorMatch& taken = best_of_query_[static_cast<std::size_t>(best)];
    if (first < taken.distance) taken = {best, static_cast<int>(j), first};
  }
  guided_.clear();
  for (const DescriptorMatch& m : best_of_query_)
    if (m.a >= 0) guided_.push_back(m);
}

void PlaceVerifier::judge(const Place& candidate, RelativePose pose) {
  std::bitset<kSpreadGrid * kSpreadGrid> cells;
  for (const DescriptorMatch& m : pose.inliers) {
    const PlaceFeature& q = query_->features[static_cast<std::size_t>(m.a)];
    const int c = std::min(kSpreadGrid - 1, static_cast<int>((q.x - low_.x()) / (high_.x() - low_.x()) * kSpreadGrid));
    const int r = std::min(kSpreadGrid - 1, static_cast<int>((q.y - low_.y()) / (high_.y() - low_.y()) * kSpreadGrid));
    cells.set(static_cast<std::size_t>(kSpreadGrid * r + c));
  }
  last_.visible = visible_;
  last_.cells = static_cast<int>(cells.count());
  last_.tilt_error_rad = tilt_error_rad(*query_, candidate, pose.T_qc.R());
  last_.pose = std::move(pose);
}

bool PlaceVerifier::accepted() const {
  const auto inliers = static_cast<int>(last_.pose.inliers.size());
  return inliers >= options_.min_inliers && inliers >= options_.min_visible_share * last_.visible && last_.cells >= kMinCells &&
         last_.tilt_error_rad < kMaxTilt_rad;
}

}  // namespace fbvins
