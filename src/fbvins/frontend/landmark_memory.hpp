// SPDX-License-Identifier: Apache-2.0
// Tracks that have ended, with all that is needed to re-observe their landmarks: descriptor, patch, position as estimated
// and the camera's position when they were last observed (docs/derivations/known_landmarks.md, K7).
// Synchronous; one instance, one thread. At most `capacity` landmarks: those not observed
// for longest are forgotten.
//
//   LandmarkMemory memory(3000);
//   memory.keep(landmark);                            // when a track has ended
//   memory.locate(track, p_G);                        // when its landmark has left the estimator's window
//   memory.expect(T_GC, camera, levels, expected);    // landmarks that the newest image should show, and where
//   memory.take_out(track);                           // re-observed: it is a track again
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/features/hamming.hpp"
#include "fbvins/features/orb.hpp"
#include "fbvins/features/patch_refine.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// Largest angle between the directions from which a landmark was observed and is searched for.
inline constexpr double kMaxViewAngle_rad = 0.6;
/// Smallest ratio of its distances then and now; the largest is the inverse.
inline constexpr double kSmallestViewScale = 0.6;

/// What is kept of a track.
struct RememberedLandmark {
  TrackId track;
  Descriptor descriptor, raw;  ///< as used, and before it was improved
  int level = 0;               ///< of the scale pyramid, when last seen
  int age_frames = 0;
  PatchReference reference;
  Mat3 R_G_reference = Mat3::Identity();  ///< of the camera that saw the reference
  double reference_depth_m = 1;           ///< along that camera's z
  Vec3 seen_from_G = Vec3::Zero();        ///< position of the camera that observed it last, m
  std::optional<Vec3> p_G;                ///< m; unknown until the landmark has left the estimator's window
  Time kept;                              ///< when it came into the memory
};

/// A remembered landmark that the newest image should show.
struct ExpectedLandmark {
  const RememberedLandmark* landmark;  ///< until the memory changes
  Vec2 px = Vec2::Zero(), normalised = Vec2::Zero();
  int level = 0;
  double depth_m = 0;  ///< along the camera's z
};

class LandmarkMemory {
 public:
  explicit LandmarkMemory(int capacity) : capacity_(capacity) {}

  void clear();
  void keep(RememberedLandmark landmark);
  void locate(TrackId track, const Vec3& p_G);
  /// Located landmarks in the view of a left camera at T_GC, from about the direction and distance of their last observation.
  /// `levels`: of the scale pyramid that keypoints come from.
  void expect(const Pose<G, C0>& T_GC, const Camera& camera, int levels, std::vector<ExpectedLandmark>& out) const;
  void take_out(TrackId track);
  /// Forgets landmarks that have not been located long after they must have left the estimator's window.
  void forget_unlocated(Time now);

  bool contains(TrackId track) const { return landmarks_.contains(track); }
  std::size_t size() const { return landmarks_.size(); }

 private:
  using Kept = std::pair<Time, TrackId>;

  int capacity_;
  std::map<TrackId, RememberedLandmark> landmarks_;  // ordered, so that results do not depend on the platform's hash
  std::set<Kept> oldest_first_;                      // all of them
  std::deque<Kept> waiting_;                         // those without a position when kept, oldest first
};

}  // namespace fbvins
