// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/frame_images.hpp"

#include <utility>

namespace fbvins {
namespace {

void clear_if_of_another_size(Pyramid& pyramid, const Camera& camera) {
  if (pyramid.width() != camera.width() || pyramid.height() != camera.height()) pyramid.clear();
}

}  // namespace

bool is_usable(const Image* image, const Camera& camera) {
  return image != nullptr && !image->empty() && image->width() == camera.width() && image->height() == camera.height();
}

FrameImages::FrameImages(const StereoRig& rig, int levels) : rig_(rig), levels_(levels) {
  if (rig.depth) reader_.emplace(rig);
}

void FrameImages::take(const StereoFrame& frame, FrontendStats& stats) {
  t_ = frame.t + frame.offsets.of(0);
  t_right_ = frame.t + frame.offsets.of(1);
  left_.clear();
  right_.clear();
  if (frame.left()) left_.build(frame.left()->view(), levels_);
  if (frame.right()) right_.build(frame.right()->view(), levels_);
  stats.mean_brightness_left = mean_brightness(left_);
  stats.mean_brightness_right = mean_brightness(right_);
  clear_if_of_another_size(left_, rig_.left());
  clear_if_of_another_size(right_, rig_.right());
  depth_ = reader_ && reader_->is_usable(frame.depth.get()) ? frame.depth : nullptr;
}

bool FrameImages::forget_before_gap(double longest_s) {
  if (!has_before() || reaches(t_, longest_s)) return false;
  before_.clear();
  return true;
}

void FrameImages::advance() {
  std::swap(left_, before_);
  t_before_ = t_;
}

Pyramid FrameImages::take_right() { return std::exchange(right_, Pyramid{}); }

void FrameImages::start_from(Pyramid image, Time t) {
  before_ = std::move(image);
  t_before_ = t;
}

}  // namespace fbvins
