// SPDX-License-Identifier: Apache-2.0
// Tracks that have ended, with what it takes to know their landmarks again: descriptor, patch, where the estimator left
// them and where they were seen from. Those that an image taken elsewhere should show are looked for in it
// (docs/derivations/known_landmarks.md, K7). Synchronous; one instance, one thread. At most `capacity` landmarks: those unseen
// for longest are forgotten.
//
//   LandmarkMemory memory(options);
//   memory.keep(landmark);                            // when a track has ended
//   memory.locate(track, p_W);                        // when the estimator has left its landmark somewhere
//   memory.expect(T_WC, camera, scales, expected);    // what the newest image should show, and where
//   memory.take_out(track);                           // found: it is a track again
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/features/hamming.hpp"
#include "fbvins/features/orb.hpp"
#include "fbvins/features/patch_refine.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

struct RecognitionOptions {
  bool enabled = true;
  int capacity = 3000;
  double search_px = 15;
  int max_distance = 50;
  double max_angle_rad = 0.6;
  double smallest_scale = 0.6;
  int min_together = 4;
  double agreement_px = 4;
  double min_correlation = 0.7;

  template <class V>
  void visit(V&& v) {
    v("enabled", enabled, "", "know landmarks again, however long they were out of view");
    v("capacity", capacity, "", "landmarks remembered", 0, 100000);
    v("search_px", search_px, "px", "search radius around where a landmark should be", 1.0, 200.0);
    v("max_distance", max_distance, "bit", "largest Hamming distance of a match", 1, 256);
    v("max_angle_rad", max_angle_rad, "rad", "largest angle between the directions it was and is seen from", 0.01, 3.1);
    v("smallest_scale", smallest_scale, "", "one that is seen smaller than this, or larger than its inverse, is not looked for",
      0.1, 1.0);
    v("min_together", min_together, "", "fewer than this in one image are chance", 1, 100);
    v("agreement_px", agreement_px, "px", "how far one may be from where the others say that it should be", 0.1, 100.0);
    v("min_correlation", min_correlation, "", "correlation asked with the patch it began with", 0.0, 1.0);
  }
};

/// What stays of a track.
struct RememberedLandmark {
  TrackId track;
  Descriptor descriptor, raw;  ///< as used, and before it was improved
  int level = 0;               ///< of the scale pyramid, when last seen
  int age_frames = 0;
  PatchReference reference;
  Mat3 R_W_reference = Mat3::Identity();  ///< of the camera that saw the reference
  double reference_depth_m = 1;           ///< along that camera's z
  Vec3 seen_from_W = Vec3::Zero();        ///< camera when it was last seen, m
  std::optional<Vec3> p_W;                ///< m; unknown until the estimator has let go of it
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
  explicit LandmarkMemory(const RecognitionOptions& options) : options_(options) {}

  void clear();
  void keep(RememberedLandmark landmark);
  void locate(TrackId track, const Vec3& p_W);
  /// Located landmarks that a left camera at T_WC sees from about where they were seen from before.
  void expect(const Pose<W, C0>& T_WC, const Camera& camera, const OrbOptions& scales, std::vector<ExpectedLandmark>& out) const;
  void take_out(TrackId track) { landmarks_.erase(track); }
  /// Landmarks that the estimator has not located long after it must have let go of them.
  void forget_unlocated(Time now);

  std::size_t size() const { return landmarks_.size(); }

 private:
  RecognitionOptions options_;
  std::map<TrackId, RememberedLandmark> landmarks_;  // in order, so that the same ones are found in the same order everywhere
};

}  // namespace fbvins
