// SPDX-License-Identifier: Apache-2.0
// A track of the orb frontend, and what happens to all of them from image to image. A track that is not seen for a moment
// (blur, occlusion, a black image) stays in the table with its descriptor and patch, and is looked for where it should be.
// Functions without state.
//
//   predict(tracks, camera, motion, depth);         // to where they should be; not observed until found
//   if (settle(track, px, camera, view)) ...        // found
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

/// Levels of the pyramid that patches are aligned on.
inline constexpr int kOrbAlignmentLevels = 3;
/// Tracks kept at most without an observation in the newest image.
inline constexpr int kMostUnobserved = 200;

struct OrbTrack : TrackState {
  /// Images over which outliers are looked for, the newest included.
  static constexpr std::size_t kHistory = 6;
  struct Sighting {
    Vec2 normalised = Vec2::Zero();
    std::int64_t image = -1;  // OrbView::index
  };

  Descriptor descriptor;  ///< as last seen
  Descriptor raw;         ///< the same before it was improved
  int level = 0;          ///< of the scale pyramid, as last seen
  Time last_seen;
  bool was_observed = false;            ///< in the image before
  bool renew_reference = false;         ///< it no longer looks like the patch it began with
  std::array<Sighting, kHistory> seen;  ///< of image i at i % kHistory
  std::optional<Vec3> seen_from_W;      ///< camera when it was last observed, m
  std::optional<Vec3> p_W;              ///< where the estimator has left its landmark, once it has, m

  void see(std::int64_t image) { seen[static_cast<std::size_t>(image) % kHistory] = {normalised, observed ? image : -1}; }
  /// Where it was seen in that image; null if it was not.
  const Vec2* sighting(std::int64_t image) const {
    const Sighting& s = seen[static_cast<std::size_t>(image) % kHistory];
    return s.image == image ? &s.normalised : nullptr;
  }
};

struct OrbPatches {
  KltTemplate newest;        ///< of the last image it was seen in; only for observed tracks
  PatchReference reference;  ///< where the track began or was renewed
};

using OrbTracks = TrackTable<OrbTrack, OrbPatches>;

/// Moves every track to where it should be in the newest image.
void predict(OrbTracks& tracks, const Camera& camera, const CameraMotion& motion, double typical_inverse_depth);
/// The track is at px in the newest image. False at the border.
bool settle(OrbTrack& track, const Vec2& px, const Camera& camera, const OrbView& view);
/// Two tracks that have come together are one: the older stays. Then no more than wanted, the older first, which is also
/// their order afterwards.
void thin_out(OrbTracks& tracks, int most, double min_distance_px);
/// Tracks that were not observed for too long, and the oldest of too many.
void forget(OrbTracks& tracks, Time now, double memory_s);
/// What observed tracks look like now; one at the border is lost.
void cut_patches(OrbTracks& tracks, const Pyramid& left, const Camera& camera);

}  // namespace fbvins
