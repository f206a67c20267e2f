// SPDX-License-Identifier: Apache-2.0
// Images that a camera, a driver or a recording delivers again with a new stamp. Equal images are rightly equal where nothing
// moves and nothing is noisy, as in a simulator, so an image is repeated only where the vehicle has turned since; once that was
// seen, a camera's images that equal the one before are, too. Images of a single grey, as of a covered lens, say nothing.
//
//   if (!repeated.take_out(packet.frame, packet.imu)) ...   // none of its images was left
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "fbvins/geometry/so3.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

class RepeatedImageFilter {
 public:
  /// Takes repeated images out of the frame. `since`: readings from the last frame for which this was true, empty without.
  /// False if the frame had images and has none any more.
  bool take_out(StereoFrame& frame, const ImuSegment& since);
  int count() const { return count_; }

 private:
  struct Seen {
    std::uint64_t fingerprint;
    Quat R_B0B;
    Time t;
  };
  struct OfCamera {
    std::deque<Seen> seen = {};  ///< the last ones that were not repeated
    bool repeats = false;
  };
  bool is_repeated(OfCamera& camera, const Image& image, const Quat& R_B0B, Time t);

  std::vector<OfCamera> cameras_;
  Quat R_B0B_ = Quat::Identity();  ///< of the last frame, by the gyroscope
  int count_ = 0;
};

}  // namespace fbvins
