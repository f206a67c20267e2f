// SPDX-License-Identifier: Apache-2.0
// A track of the orb frontend, and operations on all tracks from image to image. A track that is not observed for a moment
// (blur, occlusion, a black image) stays in the table with its descriptor and patch, and is searched for at its predicted
// position. Functions without state.
//
//   predict(tracks, camera, motion, depth);         // to their expected positions; not observed until found
//   if (set_observed(track, px, camera, view)) ...        // found
//   thin_out(tracks, 180, 14);
//   forget(tracks, view.t, 1.0);
//   tracks.drop_ended();
//   cut_patches(tracks, left, camera);
#pragma once

#include <array>
#include <optional>

#include "fbvins/features/patch_refine.hpp"
#include "fbvins/frontend/orb_view.hpp"
#include "fbvins/frontend/prediction.hpp"
#include "fbvins/frontend/track_table.hpp"

namespace fbvins {

/// Levels of the pyramid on which patches are aligned.
inline constexpr int kOrbAlignmentLevels = 3;
/// At most so many tracks without an observation in the newest image are kept.
inline constexpr int kMostUnobserved = 200;

struct OrbTrack : TrackState {
  /// Images over which outliers are looked for, the newest included.
  static constexpr std::size_t kHistory = 6;
  struct PastPosition {
    Vec2 normalised = Vec2::Zero();
    std::int64_t image = -1;  // OrbView::index
  };

  Descriptor descriptor;    ///< as last seen
  Descriptor raw;           ///< the same as extracted
  bool unimproved = false;  ///< the descriptor still is as extracted, and to be improved before it is compared
  int level = 0;            ///< of the scale pyramid, as last seen
  Time last_seen;
  bool was_observed = false;                ///< in the image before
  int newest_levels = 0;                    ///< number of the newest patch's finest levels that are cut from this image already
  bool renew_reference = false;             ///< it no longer matches the patch with which it began
  std::array<PastPosition, kHistory> seen;  ///< of image i at i % kHistory
  std::optional<Vec3> seen_from_G;          ///< position of the camera when it was last observed, m
  std::optional<Vec3> p_G;                  ///< position of its landmark, once that has left the estimator's window, m

  void see(std::int64_t image) { seen[static_cast<std::size_t>(image) % kHistory] = {normalised, observed ? image : -1}; }
  /// Its position in that image; null if it was not observed.
  const Vec2* position_in(std::int64_t image) const {
    const PastPosition& s = seen[static_cast<std::size_t>(image) % kHistory];
    return s.image == image ? &s.normalised : nullptr;
  }
};

/// What a track keeps that is too large to be moved.
struct OrbPatches {
  KltTemplate newest;        ///< of the last image in which it was observed
  PatchReference reference;  ///< of the image in which the track began or its reference was renewed
  DescriptorInput input;     ///< what the descriptor is improved from, while it is not
};

using OrbTracks = TrackTable<OrbTrack, OrbPatches>;

/// Moves every track to its predicted position in the newest image.
void predict(OrbTracks& tracks, const Camera& camera, const CameraMotion& motion, double typical_inverse_depth);
/// Gives the track the descriptor of keypoint k, which is used then.
void take_descriptor(OrbTrack& track, OrbPatches& patches, OrbView& view, std::size_t k);
/// Records that the track is observed at px in the newest image. False at the border.
bool set_observed(OrbTrack& track, const Vec2& px, const Camera& camera, const OrbView& view);
/// Of two tracks that have come together the older stays; and of all at most `most`, the older ones. Of the others, those of
/// located landmarks can be re-observed later. Tracks are sorted by age afterwards.
void thin_out(OrbTracks& tracks, int most, double min_distance_px);
/// Ends tracks that were not observed for too long, and the youngest of too many.
void forget(OrbTracks& tracks, Time now, double memory_s);
/// Cuts the newest patches of observed tracks, from the one at index `begin` on; a track at the border is lost.
void cut_patches(OrbTracks& tracks, const Pyramid& left, const Camera& camera, std::size_t begin = 0);

}  // namespace fbvins
