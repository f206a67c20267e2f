// SPDX-License-Identifier: Apache-2.0
// Positions of the tracks in the newest image, to a fraction of a pixel: by aligning their patches from the predicted
// positions or from the keypoints that their descriptors were matched with; and a forward-backward check.
// Buffers are reused; one instance, one thread.
//
//   OrbLocator locator(camera);
//   locator.follow(tracks, view, images, stats);             // by alignment alone
//   locator.locate(tracks, view, images, found, stats);      // the others; descriptors of matched tracks are renewed
#pragma once

#include <optional>
#include <vector>

#include "fbvins/frontend/frame_images.hpp"
#include "fbvins/frontend/orb_track.hpp"

namespace fbvins {

class OrbLocator {
 public:
  explicit OrbLocator(const Camera& camera) : camera_(camera) {}

  /// Follows tracks that were observed before. Those found are observed afterwards.
  void follow(OrbTracks& tracks, const OrbView& view, const FrameImages& images, FrontendStats& stats);
  /// `found`: the keypoint of each track, or -1. Tracks that are found are observed afterwards, and their keypoints used; those
  /// already observed take over the descriptor of a keypoint at their position.
  void locate(OrbTracks& tracks, OrbView& view, const FrameImages& images, const std::vector<int>& found, FrontendStats& stats);

 private:
  bool set_observed_at(const std::optional<Vec2>& px, OrbTrack& track, const OrbView& view);
  std::optional<Vec2> place(OrbTrack& track, const OrbPatches& patches, const Keypoint& keypoint, const FrameImages& images);
  std::optional<Vec2> refine_match(OrbTrack& track, const OrbPatches& patches, const Keypoint& keypoint, const Pyramid& left);
  std::optional<Vec2> follow_by_alignment(OrbTrack& track, const OrbPatches& patches, const Pyramid& left);
  std::optional<Vec2> hold_to_reference(OrbTrack& track, const OrbPatches& patches, const Vec2& newest_px, const Pyramid& left);
  void keep_patch(OrbTrack& track, OrbPatches& patches) const;
  bool returns(const OrbTrack& track, const Vec2& px, const FrameImages& images);

  Camera camera_;
  PatchRefiner refiner_;
  KltTemplate back_;  // patch found now, to be followed back; of the last track for which returns() was called
  std::vector<double> motion_px_;
};

}  // namespace fbvins
