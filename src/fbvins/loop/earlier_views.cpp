// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/earlier_views.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/angle.hpp"
#include "fbvins/features/klt.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kMostViews = 8;
/// Older views are not used: what the odometry says of the way since then gets worse.
constexpr double kOldest_s = 10;
/// A keyframe this near the newest view shows what that one does.
constexpr double kSameView_m = 0.03, kSameView_rad = 3 * kDegree;
/// Patches are compared as they are: neither turned in the image nor scaled by more than this.
constexpr double kMaxRoll_rad = 12 * kDegree, kMaxScale = 1.25;
/// A depth with this relative standard deviation counts half as much as an exact one.
constexpr double kGoodDepth = 0.05;
/// A view in which landmarks count less than this together is none.
constexpr double kLeastWorth = 8;
/// Points are searched for from this share of the distance of the nearest landmarks on, all but the nearest tenth of them, and
/// from here on.
constexpr double kNearerThanLandmarks = 0.5, kNearestSearched_m = 0.3;
constexpr std::size_t kNearestOf = 10;
/// Standard deviations of the odometry's motion from one keyframe to another: of a turn, and of a shift, of a metre.
constexpr double kTurnSigma_rad = 0.5e-3, kShiftSigma = 0.03;

}  // namespace

SecondView EarlierViews::from(const Seen& seen, const Pose<G, C0>& T_GC) const {
  const Pose<C0, C0> T = seen.T_GC.inverse() * T_GC;
  SecondView view;
  view.lens = &lens_;
  view.R = T.R(), view.p = T.p;
  view.sigma_rad = kTurnSigma_rad, view.sigma_m = kShiftSigma * T.p.norm();
  return view;
}

/// The landmarks that it shows, each by how well its depth could be measured.
double EarlierViews::worth(const SecondView& view, const std::vector<Vec3>& points_C0) const {
  if (std::abs(std::atan2(view.R(1, 0), view.R(0, 0))) > kMaxRoll_rad) return 0;
  double sum = 0;
  for (const Vec3& p : points_C0) {
    const Vec3 then = view.R * p + view.p;
    if (then.z() > kMaxScale * p.z() || p.z() > kMaxScale * then.z()) continue;
    const auto px = lens_.project(then);
    if (!px || !lens_.inside(*px, kPatchBorder_px)) continue;
    const double rho = 1 / p.z();
    const double sigma = inverse_depth_sigma(view, lens_.focal_px(), view.R * (p * rho), rho);
    const double against_good = sigma / (kGoodDepth * rho);
    sum += 1 / (1 + against_good * against_good);
  }
  return sum;
}

std::optional<EarlierView> EarlierViews::best_for(const Keyframe& keyframe, const Pose<G, C0>& T_GC) const {
  if (keyframe.reset_counter != reset_counter_) return std::nullopt;
  const Pose<C0, B> T_CB = T_BC0_.inverse();
  std::vector<Vec3> points_C0;
  std::vector<double> distances_m;
  for (const KeyframeLandmark& landmark : keyframe.landmarks) {
    const Vec3 p = T_CB * landmark.p_B;
    if (p.z() < kNearestSearched_m) continue;
    points_C0.push_back(p);
    distances_m.push_back(p.z());
  }
  std::optional<EarlierView> best;
  double most = kLeastWorth;
  for (const Seen& seen : seen_) {
    if ((keyframe.t - seen.t).seconds() > kOldest_s) continue;
    const SecondView view = from(seen, T_GC);
    const double sum = worth(view, points_C0);
    if (sum > most) most = sum, best = EarlierView{seen.image, view};
  }
  if (!best) return std::nullopt;
  const auto near = distances_m.begin() + static_cast<std::ptrdiff_t>(distances_m.size() / kNearestOf);
  std::nth_element(distances_m.begin(), near, distances_m.end());
  best->from.nearest_m = std::max(kNearestSearched_m, kNearerThanLandmarks * *near);
  return best;
}

void EarlierViews::add(const Keyframe& keyframe, const Pose<G, C0>& T_GC) {
  if (keyframe.reset_counter != reset_counter_) seen_.clear();
  reset_counter_ = keyframe.reset_counter;
  if (!keyframe.images.left()) return;
  if (!seen_.empty()) {
    const Pose<C0, C0> moved = seen_.back().T_GC.inverse() * T_GC;
    if (moved.p.norm() < kSameView_m && so3_log(moved.q).norm() < kSameView_rad) return;
  }
  seen_.push_back({keyframe.t, keyframe.images.left(), T_GC});
  if (seen_.size() > kMostViews) seen_.pop_front();
}

}  // namespace fbvins
