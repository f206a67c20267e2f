// SPDX-License-Identifier: Apache-2.0
// Follows one feature of the klt frontend into the newest image: Lucas-Kanade from its predicted position, aligned with
// the patch with which it began (its reference), and a forward-backward check.
// Holds scratch memory; one instance, one thread.
//
//   KltFollower follower(camera, kFollowedByPair);
//   if (!follower.follow(track, patches, motion, typical_inverse_depth, images, stats)) track.status = TrackStatus::lost;
#pragma once

#include <array>

#include "fbvins/features/klt.hpp"
#include "fbvins/frontend/frame_images.hpp"
#include "fbvins/frontend/prediction.hpp"
#include "fbvins/frontend/track_table.hpp"

namespace fbvins {

/// Pyramid levels, the finest included.
inline constexpr int kKltLevels = 4;

struct KltTrack : TrackState {
  static constexpr int kHistory = 6;  ///< frames of the long epipolar check
  // since its reference was taken:
  Mat3 R_now_reference = Mat3::Identity();  ///< rotation of the left camera
  double depth_ratio = 1;                   ///< depth now / depth then
  Mat2 J_normalised_pixel_reference = Mat2::Identity();
  std::array<Vec2, kHistory> history{};  ///< normalised positions, that of age a at a % kHistory

  Vec2& at_age(int age) { return history[static_cast<std::size_t>(age % kHistory)]; }
  const Vec2& at_age(int age) const { return history[static_cast<std::size_t>(age % kHistory)]; }
};

struct KltPatches {
  KltTemplate newest;
  KltReference reference;
};

/// What is done for each track.
struct KltFollowEffort {
  int predicted_level = 2;              ///< coarsest level where motion and depth are known
  int back_level = 1;                   ///< coarsest level of the backward check
  bool always_back = true;              ///< else only of tracks that no reference confirms
  double converged_px = kConverged_px;  ///< last step of an alignment
};
/// With a second camera, which checks each track as well: from two pixels away the finest level leads there, and the alignment to
/// the reference that follows is exact. One camera alone restarts more often with it (docs/experiments/speed.md).
inline constexpr KltFollowEffort kFollowedByPair{0, 0, false, 0.1};

class KltFollower {
 public:
  explicit KltFollower(const Camera& camera, const KltFollowEffort& effort = {}) : camera_(camera), effort_(effort) {}

  /// False when it is lost.
  bool follow(KltTrack& track, KltPatches& patches, const CameraMotion& motion, double typical_inverse_depth,
              const FrameImages& images, FrontendStats& stats);
  /// Takes the newest image's patch as the reference.
  void set_reference(KltTrack& track, KltPatches& patches, const Pyramid& left) const;

 private:
  Vec2 predict(const KltTrack& track, const CameraMotion& motion, double typical_inverse_depth) const;
  bool carry(KltTrack& track, const Vec2& found_px, const CameraMotion& motion) const;
  KltResult align(const KltTrack& track, KltTemplate& patch, const CameraMotion& motion, double typical_inverse_depth,
                  const FrameImages& images) const;
  bool comes_back(const KltTrack& track, const KltTemplate& newest, const Pyramid& before) const;
  KltResult align_to_reference(const KltTrack& track, const KltReference& reference, const Vec2& start_px, const Pyramid& left);

  Camera camera_;
  KltFollowEffort effort_;
  KltTemplate warped_;  // of the reference being used
};

}  // namespace fbvins
