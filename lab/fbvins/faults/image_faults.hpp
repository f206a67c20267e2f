// SPDX-License-Identifier: Apache-2.0
// What broken, covered, badly lit or mixed-up cameras deliver.
//
//   ImageFaultInjector injector(ImageFault::dark, kAllCameras, 0.03, seed);
//   injector.see(frame);                  // every good frame
//   if (broken) injector.alter(frame);    // and then those of the fault
#pragma once

#include <deque>
#include <memory>

#include "fbvins/core/rng.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// Of all cameras, or of one.
enum class ImageFault {
  frozen,      ///< the last image again and again
  cycle,       ///< the last `amount` images in turns
  each_twice,  ///< every second image is the one before
  late,        ///< the image is that of the frame before
  exchanged,   ///< left as right
  same_twice,  ///< the left image for both
  black,
  white,
  blank,          ///< grey, with the noise of a sensor
  dark,           ///< `amount` of the light, with the noise of a sensor
  noise,          ///< of `amount` grey levels
  blur,           ///< horizontally over `amount` pixels
  covered,        ///< `amount` of the width is black
  flicker,        ///< every second image has `amount` of the light
  torn,           ///< the lower half is that of the frame before
  broken_blocks,  ///< `amount` of the blocks of 16 pixels are noise
  scroll,         ///< all that is seen moves by `amount` pixels more in each frame, as one large thing in front of all cameras
  shifted,        ///< the image is `amount` pixels lower
  turned,         ///< the image is turned by `amount` degrees
  mirrored,
};

/// In place of a camera's number.
inline constexpr int kAllCameras = -1;

/// The image of a camera in the frame; null where it has no place for one.
inline std::shared_ptr<const Image>* image_in(StereoFrame& frame, int camera) {
  const auto at = static_cast<std::size_t>(camera);
  return at < frame.images.size() ? &frame.images[at] : nullptr;
}

/// A value; the same calls give the same bits.
class ImageFaultInjector {
 public:
  ImageFaultInjector(ImageFault fault, int camera, double amount, std::uint64_t seed)
      : fault_(fault), camera_(camera), amount_(amount), rng_(seed, 12) {}
  /// The next frame, unaltered.
  void see(const StereoFrame& frame);
  void alter(StereoFrame& frame);

 private:
  /// Calls change(image, camera) for the images that the fault is of.
  template <class Change>
  void each_image(StereoFrame& frame, Change&& change) const;
  void alter_pixels(Image& image);

  ImageFault fault_;
  int camera_;
  double amount_;
  Rng rng_;
  std::deque<StereoFrame> before_;  ///< newest last, the present one included
  StereoFrame held_;
  std::deque<StereoFrame> loop_;
  int count_ = 0;
};

}  // namespace fbvins
