// SPDX-License-Identifier: Apache-2.0
// What broken, covered, badly lit or mixed-up cameras deliver.
//
//   ImageSpoiler spoiler(ImageFault::dark, 0.03, seed);
//   spoiler.see(frame);                  // every good frame
//   if (broken) spoiler.alter(frame);    // and then those of the fault
#pragma once

#include <deque>
#include <memory>

#include "fbvins/core/rng.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

enum class ImageFault {
  left_frozen,   ///< the last left image again and again
  right_frozen,  ///< the last right image
  cycle,         ///< the last `amount` frames in turns
  each_twice,    ///< every second frame is the one before
  left_late,     ///< the left image is that of the frame before
  right_late,    ///< the right image is
  exchanged,     ///< left as right
  same_twice,    ///< the left image for both
  black,
  white,
  left_black,     ///< the left image
  blank,          ///< grey, with the noise of a sensor
  dark,           ///< `amount` of the light, with the noise of a sensor
  noise,          ///< of `amount` grey levels
  blur,           ///< horizontally over `amount` pixels
  covered,        ///< `amount` of the width of both images is black
  right_covered,  ///< of the right one
  flicker,        ///< every second frame has `amount` of the light
  right_darker,   ///< the right image has `amount` of the light
  torn,           ///< the lower half is that of the frame before
  broken_blocks,  ///< `amount` of the blocks of 16 pixels are noise
  scroll,         ///< all that is seen moves by `amount` pixels more in each frame, as one large thing in front of both cameras
  right_shifted,  ///< the right image is `amount` pixels lower
  right_turned,   ///< the right image is turned by `amount` degrees
  both_turned,    ///< both are
  mirrored,
};

/// A value; the same calls give the same bits.
class ImageSpoiler {
 public:
  ImageSpoiler(ImageFault fault, double amount, std::uint64_t seed) : fault_(fault), amount_(amount), rng_(seed, 12) {}
  /// The next frame, unaltered.
  void see(const StereoFrame& frame);
  void alter(StereoFrame& frame);

 private:
  void alter_pixels(Image& image, bool right);

  ImageFault fault_;
  double amount_;
  Rng rng_;
  std::deque<StereoFrame> before_;  ///< newest last, the present one included
  StereoFrame held_;
  std::deque<StereoFrame> loop_;
  int count_ = 0;
};

}  // namespace fbvins
