// SPDX-License-Identifier: Apache-2.0
// Finds a feature of the left image in the right one: from its last depth, or by a correlation search along the
// epipolar curve on a coarse level; then Lucas-Kanade, backward check and epipolar check. Where the images are turned against
// each other the patch is turned too, and the search is on the finest level. One instance is used by one thread at a time (it
// reuses a template as scratch).
//
//   KltStereoMatcher matcher(rig, 0.35);
//   auto match = matcher.match(patch, px, normalised, inverse_depth, left, right);
#pragma once

#include <optional>

#include "fbvins/camera/camera.hpp"
#include "fbvins/features/patch_refine.hpp"
#include "fbvins/features/pyramid.hpp"
#include "fbvins/frontend/track_table.hpp"

namespace fbvins {

/// A match nearer to the right image's edge is not used.
inline constexpr double kRightBorder_px = 2;

/// Whether a match lies in the right image, with a patch that shows the world.
inline bool visible_in_right(const Camera& right, const Vec2& px) {
  return right.inside(px, kRightBorder_px) && !right.hidden(px, kPatchBorder_px);
}

enum class StereoFailure { none, flow, check, epipolar };

struct StereoMatch {
  Vec2 px = Vec2::Zero();          ///< in the right image
  Vec2 normalised = Vec2::Zero();  ///< in C1
  double inverse_depth = 0;        ///< 1/m along z of C0, not negative
  StereoFailure failure = StereoFailure::flow;
};

/// What a frontend can do without.
struct KltStereoEffort {
  int known_depth_level = 1;    ///< coarsest level of the alignment from a depth that is known
  double sure_correlation = 2;  ///< a match that correlates by more is not followed back into the left image; 2: all are
};

/// Whether a track is searched for along its line in this image: a new one, or every fourth time. What the right image does not
/// show, the next one mostly does not, either.
inline bool searches_line(const TrackState& track) {
  return track.age_frames < 2 || (static_cast<std::int64_t>(track.id.value) + track.age_frames) % 4 == 0;
}

class KltStereoMatcher {
 public:
  /// `min_depth_m`: smallest depth that is searched for in the right image.
  KltStereoMatcher(const StereoRig& rig, double min_depth_m, const KltStereoEffort& effort = {});

  /// Between the images that are matched next.
  void place(const Pose<C1, C0>& T_C1C0);
  /// `patch` holds the templates of levels 0 and up around `left_px`. match.failure is the check that failed, if any. `search`:
  /// along the whole line, where the depth is not known or not the right one.
  StereoMatch match(const KltTemplate& patch, const Vec2& left_px, const Vec2& left_normalised,
                    std::optional<double> inverse_depth, const Pyramid& left, const Pyramid& right, bool search = true);

 private:
  std::optional<Vec2> project(const Vec2& left_normalised, double inverse_depth) const;
  std::optional<Vec2> best_along_line(const KltTemplate& patch, const Vec2& left_normalised, const Pyramid& right) const;
  StereoMatch refine(const KltTemplate& patch, const Vec2& left_px, const Vec2& left_normalised, const Vec2& start_px,
                     int coarsest, const Pyramid& left, const Pyramid& right);
  StereoMatch match_turned(const Vec2& left_px, const Vec2& left_normalised, std::optional<double> inverse_depth,
                           const Pyramid& left, const Pyramid& right, bool search);
  std::optional<double> search_turned(const PatchReference& reference, const Vec2& left_normalised, const Pyramid& right);
  StereoMatch refine_turned(const PatchReference& reference, const Vec2& left_px, const Vec2& left_normalised,
                            double inverse_depth, const Pyramid& left, const Pyramid& right);
  /// Where the ray is found in the right image, if that shows it; false else.
  bool place_in_right(const Vec2& px, const Vec2& left_normalised, StereoMatch& match) const;
  /// Epipolar distance and depth of a match.
  StereoFailure check_geometry(const Vec2& left_normalised, StereoMatch& match) const;

  double min_depth_m_;
  KltStereoEffort effort_;
  Camera camera_left_, camera_right_;
  bool turned_;
  Mat3 R_rl_;  // C1 <- C0
  Vec3 p_rl_;
  double focal_px_;
  KltTemplate scratch_, whole_;
  PatchRefiner refiner_;
};

}  // namespace fbvins
