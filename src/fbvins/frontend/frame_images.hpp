// SPDX-License-Identifier: Apache-2.0
// The images that tracks are followed in: pyramids of the newest stereo image and of the left one before it.
// Buffers are reused; one instance, one thread.
//
//   FrameImages images(rig, 4);
//   images.take(packet.frame, stats);
//   if (images.forget_before_gap(0.6)) drop_all_tracks();
//   if (images.has_before()) follow(images.before(), images.left());
//   images.advance();
#pragma once

#include <memory>
#include <optional>

#include "fbvins/camera/depth_reader.hpp"
#include "fbvins/features/pyramid.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// Whether there is an image, of the size that the camera was calibrated with.
bool is_usable(const Image* image, const Camera& camera);

class FrameImages {
 public:
  FrameImages(const StereoRig& rig, int levels);

  /// The newest images. One that is missing, or of another size than the calibration's (its geometry is unknown), is empty.
  void take(const StereoFrame& frame, FrontendStats& stats);
  /// Drops the image before if time went backwards, or on by more than `longest_s`, since then. False where there was none,
  /// or no gap.
  bool forget_before_gap(double longest_s);
  /// The newest left image becomes the one before.
  void advance();
  /// Moves the newest right image out; empty if there was none.
  Pyramid take_right();
  /// Another's image becomes the one before.
  void start_from(Pyramid image, Time t);

  /// When the newest left image was taken, and the right one.
  Time t() const { return t_; }
  Time t_right() const { return t_right_; }
  const Pyramid& left() const { return left_; }
  const Pyramid& right() const { return right_; }
  /// Whether depths can be measured in the newest images: in the right one, or because they came.
  bool has_depth() const { return !right_.empty() || depth_ != nullptr; }
  bool has_depth_image() const { return depth_ != nullptr; }
  /// Of the newest depth image, which there is.
  std::optional<MeasuredInverseDepth> depth_at(const Vec2& left_px) const { return reader_->at(*depth_, left_px); }
  bool has_before() const { return !before_.empty(); }
  bool reaches(Time t, double longest_s) const {
    return has_before() && t >= t_before_ && (t - t_before_).seconds() <= longest_s;
  }
  Time t_before() const { return t_before_; }
  const Pyramid& before() const { return before_; }

 private:
  StereoRig rig_;
  int levels_;
  Time t_, t_right_, t_before_;
  Pyramid left_, right_, before_;
  std::optional<DepthReader> reader_;  // of a rig with a depth sensor
  std::shared_ptr<const DepthImage> depth_;
};

}  // namespace fbvins
