// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/relocaliser.hpp"

#include <algorithm>

#include "fbvins/loop/map_edges.hpp"

namespace fbvins {
namespace {

/// A guess of G in M is forgotten after this.
constexpr double kGuessLife_s = 5;
/// Largest difference between the results of two keyframes that agree.
constexpr double kAgree_m = 0.15, kAgree_rad = 2.5 * kDegree;
/// With this many inliers, and this share of the visible landmarks, no second keyframe is needed.
constexpr int kSureInliers = 90;
constexpr double kSureShare = 0.35;

bool beyond_doubt(const VerifiedPose& verified) {
  const auto inliers = static_cast<int>(verified.pose.inliers.size());
  return inliers >= kSureInliers && inliers > kSureShare * verified.visible;
}

}  // namespace

std::optional<Pose<M, G>> Relocaliser::consider(const MapKeyframe& query, const Quat& q_LG, const Pose<M, B>& T_MB,
                                                const VerifiedPose& verified, int tag) {
  std::erase_if(guesses_, [&](const Guess& g) { return (query.t - g.t).seconds() > kGuessLife_s; });
  const Quat q_MG = about_z(yaw_of(T_MB.q * query.T_GB.q.conjugate() * q_LG.conjugate())) * q_LG;
  const Guess guess{query.t, tag, {q_MG, Vec3(T_MB.p - q_MG * query.T_GB.p)}};
  const bool agreed = std::any_of(guesses_.begin(), guesses_.end(), [&](const Guess& g) {
    const bool independent = g.tag != tag || (tag == kNoTag && g.t != guess.t);
    return independent && (g.T_MG * query.T_GB.p - T_MB.p).norm() < kAgree_m &&
           angle_between(g.T_MG.q, guess.T_MG.q) < kAgree_rad;
  });
  if (agreed || beyond_doubt(verified)) return guess.T_MG;
  guesses_.push_back(guess);
  return std::nullopt;
}

}  // namespace fbvins
