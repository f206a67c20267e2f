// SPDX-License-Identifier: Apache-2.0
// The depth of the observed tracks: by the depth image where the rig has such a sensor, or by the right image, by aligning the
// patch along the epipolar line. Buffers are reused; one instance, one thread.
//
//   OrbDepth depth(rig, options);
//   depth.match(tracks, images, stats);
#pragma once

#include <vector>

#include "fbvins/frontend/frame_images.hpp"
#include "fbvins/frontend/klt_stereo.hpp"
#include "fbvins/frontend/orb_options.hpp"
#include "fbvins/frontend/orb_track.hpp"
#include "fbvins/frontend/rectified_pair.hpp"
#include "fbvins/frontend/typical_depth.hpp"

namespace fbvins {

class OrbDepth {
 public:
  OrbDepth(const StereoRig& rig, const OrbFrontendOptions& options);

  /// Between the images that are matched next.
  void place(const Pose<C1, C0>& T_C1C0);
  void match(OrbTracks& tracks, const FrameImages& images, FrontendStats& stats);
  /// As if these had been matched, 1/m.
  void assume(std::vector<double>& inverse_depths) { typical_.update(inverse_depths); }
  /// Median of the last image's matches, 1/m.
  double typical_inverse_depth() const { return typical_.inverse_depth(); }

 private:
  static bool take_measured(OrbTrack& track, const FrameImages& images);
  bool match(OrbTrack& track, const OrbPatches& patches, const FrameImages& images);

  Camera right_camera_;
  double sigma_px_;
  RectifiedPair rectified_;
  KltStereoMatcher by_alignment_;
  TypicalDepth typical_;
  std::vector<double> inverse_depths_;
};

}  // namespace fbvins
