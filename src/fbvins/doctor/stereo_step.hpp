// SPDX-License-Identifier: Apache-2.0
// Right images that are late or early by whole images: one queue too many in a driver, or messages paired by arrival. Found by
// the epipolar error of a rig in motion, which is small for one lag alone. One thread.
//
//   evidence.step = stereo_step(rig, held, free_stereo);
//   StereoRealigner realigner(evidence.step.lag);
//   if (auto in_step = realigner.push(frame)) look(*in_step);
#pragma once

#include <deque>
#include <optional>
#include <span>

#include "fbvins/doctor/evidence.hpp"
#include "fbvins/doctor/free_stereo.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// From consecutive `frames`. The lag is 0 where images of the same stamp fit, or where no lag fits much better.
StereoStep stereo_step(const StereoRig& rig, std::span<const StereoFrame> frames, FreeStereo& stereo);

/// Whether two left images differ by no more than noise, on average.
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
