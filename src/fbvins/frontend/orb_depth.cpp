// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_depth.hpp"

#include "fbvins/frontend/observe.hpp"

namespace fbvins {
OrbDepth::OrbDepth(const StereoRig& rig, const OrbFrontendOptions& options, double sigma_px)
    : right_camera_(rig.right),
      subpixel_(options.subpixel),
      fill_in_(options.fill_in),
      by_descriptors_(!options.follows_patches()),
      sigma_px_(sigma_px),
      by_descriptor_(rig, options.min_depth_m, options.stereo_epipolar_px),
      by_alignment_(rig, options.min_depth_m) {}

void OrbDepth::place(const Pose<C1, C0>& T_C1C0) {
  by_descriptor_.place(T_C1C0);
  by_alignment_.place(T_C1C0);
}

void OrbDepth::match(OrbTracks& tracks, const FrameImages& images, FrontendStats& stats) {
  if (wants_features() && !images.has_depth_image()) by_descriptor_.index(right_features_);
  inverse_depths_.clear();
  for (OrbTrack& track : tracks) {
    if (!track.observed) continue;
    if (!(images.has_depth_image() ? take_measured(track, images) : match(track, tracks.patches(track), images))) continue;
    inverse_depths_.push_back(*track.inverse_depth);
    ++stats.stereo;
  }
  typical_.update(inverse_depths_);
}

bool OrbDepth::take_measured(OrbTrack& track, const FrameImages& images) {
  const auto depth = images.depth_at(track.px);
  if (!depth) return false;
  track.right = observe_depth(track.px, track.normalised, *depth);
  track.inverse_depth = depth->value;
  return true;
}

bool OrbDepth::match(OrbTrack& track, const OrbPatches& patches, const FrameImages& images) {
  const auto px = find(track, patches, images);
  if (!px) return false;
  const auto normalised = right_camera_.undistort(*px);
  if (!normalised) return false;
  const auto rho = by_descriptor_.inverse_depth(track.normalised, *normalised);
  if (!rho) return false;
  track.right = observe(right_camera_, *px, *normalised, sigma_px_);
  track.inverse_depth = *rho;
  return true;
}

std::optional<Vec2> OrbDepth::find(const OrbTrack& track, const OrbPatches& patches, const FrameImages& images) {
  const int k = wants_features() ? by_descriptor_.candidate(track.normalised, track.level, track.descriptor) : -1;
  if (k >= 0) {
    const Keypoint& keypoint = right_features_.keypoints[static_cast<std::size_t>(k)];
    if (!subpixel_) return keypoint.pixel;
    const KltResult fine = klt_align(patches.newest, images.right(), keypoint.pixel, kNearLevel, 0);
    if (refiner_.accept(fine, keypoint.pixel, keypoint.scale) && visible_in_right(right_camera_, fine.px)) return fine.px;
  }
  if (!fill_in_) return std::nullopt;
  const StereoMatch match =
      by_alignment_.match(patches.newest, track.px, track.normalised, track.inverse_depth, images.left(), images.right());
  if (match.failure != StereoFailure::none) return std::nullopt;
  return match.px;
}

}  // namespace fbvins
