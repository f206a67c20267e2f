// SPDX-License-Identifier: Apache-2.0
// Landmarks re-observed after they were out of view (docs/derivations/known_landmarks.md, K7): tracks that end are remembered,
// and begin again under their old id where descriptor, patch and the prediction errors of the others agree.
// Buffers are reused; one instance, one thread.
//
//   OrbRecogniser recogniser(camera, options.recognition, levels);
//   tracks.drop_ended([&](const OrbTrack& t, const OrbPatches& p) { recogniser.remember(t, p.reference, view, now); });
//   recogniser.locate(update, tracks);                 // their positions, from the estimator
//   recogniser.recognise(tracks, view, left, improver, stats);
#pragma once

#include <vector>

#include "fbvins/frontend/landmark_memory.hpp"
#include "fbvins/frontend/orb_improver.hpp"
#include "fbvins/frontend/orb_options.hpp"
#include "fbvins/frontend/orb_track.hpp"

namespace fbvins {

class OrbRecogniser {
 public:
  /// `levels`: of the scale pyramid that keypoints come from.
  OrbRecogniser(const Camera& camera, const RecognitionOptions& options, int levels)
      : camera_(camera), options_(options), levels_(levels), memory_(options.capacity) {}

  void locate(const LandmarkUpdate& update, OrbTracks& tracks);
  /// G is a new frame, or what was known in it no longer fits: all positions are void.
  void clear(OrbTracks& tracks);
  /// Whether a track that goes out of view may be a landmark. `view`: the last image that it was predicted to.
  bool wants(const OrbTrack& track, const OrbView& view) const;
  /// Remembers it, if so. Its descriptor is improved.
  void remember(const OrbTrack& track, const PatchReference& reference, const OrbView& view, Time now);
  /// It is followed again.
  void forget(TrackId track) { memory_.take_out(track); }
  bool remembers(TrackId track) const { return memory_.contains(track); }
  void forget_unlocated(Time now) { memory_.forget_unlocated(now); }
  void recognise(OrbTracks& tracks, OrbView& view, const Pyramid& left, OrbImprover& improver, FrontendStats& stats);

 private:
  bool resume(const ExpectedLandmark& expected, std::size_t keypoint, OrbTracks& tracks, OrbView& view, const Pyramid& left);

  Camera camera_;
  RecognitionOptions options_;
  int levels_;
  LandmarkMemory memory_;
  PatchRefiner refiner_;
  GuidedMatcher matcher_;
  std::vector<ExpectedLandmark> expected_;
  std::vector<GuidedQuery> queries_;
  std::vector<int> found_;
  std::vector<double> miss_x_px_, miss_y_px_;
};

}  // namespace fbvins
