// SPDX-License-Identifier: Apache-2.0
// Right images that come whole images late or early: a queue too many in a driver, or messages paired by arrival. Told by the
// epipolar error of a rig in motion, which is small for one lag alone. One thread.
//
//   evidence.step = stereo_step(rig, held, free_stereo);
//   StereoRealigner realigner(evidence.step.lag);
//   if (auto frame = realigner.push(frame)) look(*frame);
#pragma once

#include <deque>
#include <optional>
#include <span>

#include "fbvins/doctor/evidence.hpp"
#include "fbvins/doctor/free_stereo.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// By consecutive `frames`. The lag is 0 where images of the same stamp fit, or where none fits much better.
StereoStep stereo_step(const StereoRig& rig, std::span<const StereoFrame> frames, FreeStereo& stereo);

/// Nothing but noise is different between two images, up to a small motion.
bool nearly_same(const StereoFrame& a, const StereoFrame& b);

class StereoRealigner {
 public:
  explicit StereoRealigner(int lag = 0) : lag_(lag) {}
  /// A left image, its stamp and the right image that belongs to it; none until that has come.
  std::optional<StereoFrame> push(StereoFrame frame);

 private:
  int lag_;
  std::deque<StereoFrame> waiting_;
};

}  // namespace fbvins
