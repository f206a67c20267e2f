// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_track.hpp"

#include <algorithm>
#include <utility>

namespace fbvins {
namespace {

/// A track expected this far outside the image is forgotten.
constexpr double kFarOutside_px = 40;
/// Smallest depth now / depth before; nearer, or behind the camera, a prediction is useless.
constexpr double kNearestAhead = 0.1;
/// Tracks nearer to each other than 0.4 of the smallest distance are taken as one; here its square.
constexpr double kTogetherShare2 = 0.16;
/// A track without depth, whose prediction soon is useless, is searched for during this share of the usual time.
constexpr double kMemoryWithoutDepth = 0.3;
/// Tracks of fewer images are not searched for.
constexpr int kFewestFrames = 2;

void predict_one(OrbTrack& track, PatchReference& reference, const Camera& camera, const CameraMotion& motion,
                 double typical_inverse_depth) {
  const auto carried = carry_point(camera, motion, track.normalised, track.inverse_depth.value_or(typical_inverse_depth));
  if (!carried || !(carried->p.z() > kNearestAhead)) {
    track.status = TrackStatus::lost;
    return;
  }
  track.px += carried->b_px - carried->a_px;
  track.normalised = carried->p.hnormalized();
  if (track.inverse_depth) *track.inverse_depth /= carried->p.z();
  reference.carry(motion.R_ba, carried->p.z());
  if (!camera.inside(track.px, -kFarOutside_px)) track.status = TrackStatus::out_of_view;
}

}  // namespace

void predict(OrbTracks& tracks, const Camera& camera, const CameraMotion& motion, double typical_inverse_depth) {
  for (OrbTrack& track : tracks) {
    track.was_observed = track.observed;
    track.observed = false;
    track.right.reset();
    track.previous_normalised = track.normalised;
    track.previous_px = track.px;
    track.previous_inverse_depth = track.inverse_depth;
    if (motion.has_rotation) predict_one(track, tracks.patches(track).reference, camera, motion, typical_inverse_depth);
  }
}

void take_descriptor(OrbTrack& track, OrbPatches& patches, OrbView& view, std::size_t k) {
  track.descriptor = view.descriptor(k);
  track.raw = view.raw_descriptor(k);
  track.level = view.features.keypoints[k].level;
  track.unimproved = view.improves && view.improved[k] == 0;
  if (track.unimproved) patches.input = view.input(k);
  view.used[k] = 1;
}

bool set_observed(OrbTrack& track, const Vec2& px, const Camera& camera, const OrbView& view) {
  if (!camera.inside(px, kPatchBorder_px)) return false;
  const auto normalised = camera.undistort(px);
  if (!normalised) return false;
  track.px = px;
  track.normalised = *normalised;
  track.observed = true;
  track.last_seen = view.t;
  if (view.T_GC) track.seen_from_G = view.T_GC->p;
  ++track.age_frames;
  return true;
}

void thin_out(OrbTracks& tracks, int most, double min_distance_px) {
  std::stable_sort(tracks.begin(), tracks.end(),
                   [](const OrbTrack& a, const OrbTrack& b) { return a.age_frames > b.age_frames; });
  const double closest2 = kTogetherShare2 * min_distance_px * min_distance_px;
  std::vector<Vec2> kept;
  kept.reserve(tracks.size());
  for (OrbTrack& track : tracks) {
    if (!track.observed) continue;
    const bool crowded =
        std::any_of(kept.begin(), kept.end(), [&](const Vec2& other) { return (other - track.px).squaredNorm() < closest2; });
    if (crowded || static_cast<int>(kept.size()) == most) track.status = track.p_G ? TrackStatus::out_of_view : TrackStatus::lost;
    else kept.push_back(track.px);
  }
}

void forget(OrbTracks& tracks, Time now, double memory_s) {
  int remembered = 0;
  for (OrbTrack& track : tracks) {
    if (track.observed) continue;
    const double patience_s = track.inverse_depth ? memory_s : kMemoryWithoutDepth * memory_s;
    const bool too_long = (now - track.last_seen).seconds() > patience_s;
    if (too_long || track.age_frames < kFewestFrames || remembered == kMostUnobserved) track.status = TrackStatus::out_of_view;
    else ++remembered;
  }
}

void cut_patches(OrbTracks& tracks, const Pyramid& left, const Camera& camera, std::size_t begin) {
  for (std::size_t i = begin; i < tracks.size(); ++i) {
    OrbTrack& track = tracks[i];
    if (!track.observed) continue;
    OrbPatches& patches = tracks.patches(track);
    const int first = std::exchange(track.newest_levels, 0);
    const bool cut = patches.newest.cut(left, track.px, first, kOrbAlignmentLevels - 1);
    if (first == 0 && !cut) track.status = TrackStatus::lost;
    else if (track.renew_reference) patches.reference.take(left, track.px, camera, track.normalised);
    track.renew_reference = false;
  }
}

}  // namespace fbvins
