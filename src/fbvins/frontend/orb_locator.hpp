// SPDX-License-Identifier: Apache-2.0
// Positions of the tracks in the newest image, to a fraction of a pixel: by aligning their patches from the predicted
// positions or from the keypoints that their descriptors were matched with; and a forward-backward check.
// Buffers are reused; one instance, one thread.
//
//   OrbLocator locator(camera, {.subpixel = true, .fill_in = true, .follows = true});
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
  struct Choices {
    bool subpixel = true;  ///< refine positions of keypoints
    bool fill_in = true;   ///< follow tracks without a keypoint
    bool follows = false;  ///< follow() has followed them
  };
  OrbLocator(const Camera& camera, const Choices& choices) : camera_(camera), choices_(choices) {}

  /// Follows tracks that were observed before, if choices.follows. Those found are observed afterwards.
  void follow(OrbTracks& tracks, const OrbView& view, const FrameImages& images, FrontendStats& stats);
  /// `found`: the keypoint of each track, or -1. Tracks that are found are observed afterwards, and their keypoints used; those
  /// already observed take over the descriptor of a keypoint at their position.
  void locate(OrbTracks& tracks, OrbView& view, const FrameImages& images, const std::vector<int>& found, FrontendStats& stats);

 private:
  bool set_observed_at(const std::optional<Vec2>& px, OrbTrack& track, const OrbView& view);
  Vec2 common_miss(const OrbTracks& tracks, const OrbView& view, const std::vector<int>& found);
  std::optional<Vec2> place(OrbTrack& track, const OrbPatches& patches, const Keypoint* keypoint, const Vec2& expected_px,
                            const FrameImages& images, FrontendStats& stats);
  std::optional<Vec2> refine_match(OrbTrack& track, const OrbPatches& patches, const Keypoint& keypoint, const Pyramid& left);
  std::optional<Vec2> follow_by_alignment(OrbTrack& track, const OrbPatches& patches, const Vec2& expected_px,
                                          const Pyramid& left);
  std::optional<Vec2> hold_to_reference(OrbTrack& track, const OrbPatches& patches, const Vec2& newest_px, const Pyramid& left);
  bool returns(const OrbTrack& track, const Vec2& px, const FrameImages& images);

  Camera camera_;
  Choices choices_;
  PatchRefiner refiner_;
  KltTemplate back_;  // patch found now, to be followed back
  std::vector<double> miss_x_px_, miss_y_px_, motion_px_;
};

}  // namespace fbvins
