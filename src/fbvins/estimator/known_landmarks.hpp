// SPDX-License-Identifier: Apache-2.0
// Landmarks that have left the window, where they were, and how well that is known
// (docs/derivations/known_landmarks.md, K1-K6). One that comes into the window again under its old track holds the window to W.
//
// Each is known relative to the map around it, which drifted as one: what it has in common is kept once for all
// landmarks of a moment, as an anchor, and is part of what W is uncertain of from then on.
// Synchronous; one instance, one thread. At most `capacity` landmarks: the oldest are forgotten.
//
//   covariance = known.anchor(T_WB, covariance, beliefs_in_use);   // after each solve
//   known.remember(track, T_WC, point, V);                         // when a landmark leaves
//   landmark.belief = known.find(track);                           // when a track appears
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/estimator/landmark_belief.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

class KnownLandmarks {
 public:
  explicit KnownLandmarks(const KnownLandmarkOptions& options) : options_(options) {}

  void clear();
  /// The newest pose and its covariance of (dp in W, dtheta in B) in the window alone. Adds what the pose owes to the
  /// map it is held to (K5, K6), and returns their sum. Landmarks remembered from now on are as uncertain in common.
  Mat6 anchor(const Pose<W, B>& T_WB, const Mat6& window_covariance, std::span<const LandmarkBelief> in_use);
  /// A landmark leaves: its host's camera, (alpha, beta, rho) and their information given the poses. The first time counts,
  /// it has drifted least; not one whose depth is too uncertain.
  void remember(TrackId track, const Pose<W, C0>& T_WC, const Vec3& alpha_beta_rho, const Mat3& information);
  std::optional<LandmarkBelief> find(TrackId track) const;
  void forget(TrackId track);
  /// Those remembered since the last call.
  std::vector<LocatedLandmark> take_new() { return std::exchange(new_, {}); }

  std::size_t size() const { return beliefs_.size(); }

 private:
  struct Anchor {
    Vec3 p_W = Vec3::Zero();
    Mat6 covariance = Mat6::Zero();  // (dp, dtheta) in W
  };
  void hold_to(const Vec3& p_W, std::span<const LandmarkBelief> in_use);
  static Mat6 carried(const Anchor& anchor, const Vec3& p_W);
  void make_room();

  KnownLandmarkOptions options_;
  std::unordered_map<TrackId, LandmarkBelief> beliefs_;
  std::deque<TrackId> order_;      // as remembered
  std::deque<Anchor> anchors_;     // of the landmarks remembered, oldest first
  std::int64_t first_anchor_ = 0;  // number of the oldest
  Anchor next_;                    // of those remembered next
  bool level_ = false;             // W is known to be, well enough to remember anything in it
  Anchor held_to_;                 // what the newest pose is held to
  std::vector<LocatedLandmark> new_;
};

}  // namespace fbvins
