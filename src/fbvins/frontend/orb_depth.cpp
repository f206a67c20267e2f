// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_depth.hpp"

#include "fbvins/frontend/observe.hpp"

namespace fbvins {
OrbDepth::OrbDepth(const StereoRig& rig, const OrbFrontendOptions& options)
    : right_camera_(rig.right()),
      sigma_px_(options.sigma_px),
      rectified_(rig, options.min_depth_m, options.stereo_epipolar_px),
      by_alignment_(rig, options.min_depth_m) {}

void OrbDepth::place(const Pose<C1, C0>& T_C1C0) {
  rectified_.place(T_C1C0);
  by_alignment_.place(T_C1C0);
}

void OrbDepth::match(OrbTracks& tracks, const FrameImages& images, FrontendStats& stats) {
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
  const StereoMatch match = by_alignment_.match(patches.newest, track.px, track.normalised, track.inverse_depth, images.left(),
                                                images.right(), searches_line(track));
  if (match.failure != StereoFailure::none) return false;
  const auto normalised = right_camera_.undistort(match.px);
  if (!normalised) return false;
  const auto rho = rectified_.inverse_depth(track.normalised, *normalised);
  if (!rho) return false;
  track.right = observe(right_camera_, match.px, *normalised, sigma_px_);
  track.inverse_depth = *rho;
  return true;
}

}  // namespace fbvins
