// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_verifier.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <numbers>

namespace fbvins {

PlaceVerifierOptions for_boosted(PlaceVerifierOptions options) {
  constexpr int kFarthest = 60;  // 97 % of true pairs, docs/results.md
  options.matching.max_distance = std::min(options.matching.max_distance, kFarthest);
  options.guided_distance = std::min(options.guided_distance, kFarthest);
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
  return static_cast<double>(last_.pose.inliers.size()) >= options_.mutual_share * options_.min_inliers &&
         difference.p.norm() < options_.mutual_m && so3_log(difference.q).norm() < options_.mutual_rad;
}

std::optional<VerifiedPose> PlaceVerifier::one_way(const Place& candidate) {
  last_ = {};
  if (query_ == nullptr || query_->size() == 0 || candidate.size() == 0) return std::nullopt;
  const auto matches = match_descriptors(query_->descriptors, candidate.descriptors, options_.matching);
  if (static_cast<int>(matches.size()) < options_.min_matches) return std::nullopt;
  Rng rng(static_cast<std::uint64_t>(options_.seed));
  const auto start = ransac_pose(*query_, candidate, matches, options_.pose, rng);
  if (!start) return std::nullopt;
  const RelativePose rough = refine_pose(*query_, candidate, matches, *start, options_.pose);
  const bool better = rough.inliers.size() >= 6;
  return collect(candidate, better ? rough.T_qc : *start, 1.5 * options_.guided_px, 2);
}

std::optional<VerifiedPose> PlaceVerifier::verify(const Place& candidate, const PosePrediction& prediction) {
  last_ = {};
  if (query_ == nullptr || query_->size() == 0 || candidate.size() == 0) return std::nullopt;
  return collect(candidate, prediction.T_qc, prediction.radius_px, 2);
}

std::optional<VerifiedPose> PlaceVerifier::collect(const Place& candidate, CameraFromCamera start, double radius_px, int rounds) {
  for (int round = 0; round < rounds; ++round) {
    match_guided(candidate, start, radius_px);
    if (static_cast<int>(guided_.size()) < options_.min_inliers / 2) return std::nullopt;
    RelativePose pose = refine_pose(*query_, candidate, guided_, start, options_.pose);
    start = pose.T_qc;
    radius_px = std::min(radius_px, options_.guided_px);
    judge(candidate, std::move(pose));
    if (static_cast<int>(last_.pose.inliers.size()) < options_.min_inliers / 2) return std::nullopt;
  }
  return accepted() ? std::optional(last_) : std::nullopt;
}

/// Each point of the candidate looks around where it should be; of those that want the same feature the most similar
/// gets it.
void PlaceVerifier::match_guided(const Place& candidate, const CameraFromCamera& T_qc, double radius_px) {
  const Mat3 R = T_qc.R();
  const Vec2 cell((high_.x() - low_.x()) / kColumns, (high_.y() - low_.y()) / kRows);
  best_of_query_.assign(query_->size(), {-1, -1, 1 << 20});
  visible_ = 0;
  for (std::size_t j = 0; j < candidate.size(); ++j) {
    const PlaceFeature& c = candidate.features[j];
    if (!c.has_point()) continue;
    const Vec3 p = R * c.p_C0() + T_qc.p;
    if (!(p.z() > 0.1)) continue;
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
    int best = -1, first = options_.guided_distance + 1;
    for (int r = r0; r <= r1; ++r)
      for (std::int32_t k = cell_begin_[static_cast<std::size_t>(r * kColumns + c0)];
           k < cell_begin_[static_cast<std::size_t>(r * kColumns + c1) + 1]; ++k) {
        const auto i = static_cast<std::size_t>(by_cell_[static_cast<std::size_t>(k)]);
        const PlaceFeature& q = query_->features[i];
        if ((q.xy() - at).squaredNorm() > reach * reach) continue;
        if (q.sigma_xy > 1.8 * sigma_expected || sigma_expected > 1.8 * q.sigma_xy) continue;
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
  std::bitset<16> cells;
  for (const DescriptorMatch& m : pose.inliers) {
    const PlaceFeature& q = query_->features[static_cast<std::size_t>(m.a)];
    const int c = std::min(3, static_cast<int>((q.x - low_.x()) / (high_.x() - low_.x()) * 4));
    const int r = std::min(3, static_cast<int>((q.y - low_.y()) / (high_.y() - low_.y()) * 4));
    cells.set(static_cast<std::size_t>(4 * r + c));
  }
  last_.visible = visible_;
  last_.cells = static_cast<int>(cells.count());
  last_.tilt_error_rad = tilt_error_rad(*query_, candidate, pose.T_qc.R());
  last_.pose = std::move(pose);
}

bool PlaceVerifier::accepted() const {
  const auto inliers = static_cast<int>(last_.pose.inliers.size());
  return inliers >= options_.min_inliers && inliers >= options_.min_visible_share * last_.visible &&
         last_.cells >= options_.min_cells && last_.tilt_error_rad < options_.pose.max_tilt_deg * std::numbers::pi / 180;
}

}  // namespace fbvins
