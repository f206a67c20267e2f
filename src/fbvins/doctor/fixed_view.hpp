// SPDX-License-Identifier: Apache-2.0
// Masks of what is fixed in view: legs, guards, dirt on the lens. Edges that stay at their pixels while the scene moves across
// them.
//
//   ViewSampler sampler;                                       // of one recording, one thread
//   sampler.add(t, scene_moved_px, left_pyramid, right_pyramid);
//   evidence.views = sampler.take();
//   FixedInView fixed = find_fixed(evidence, imu);             // pure function
#pragma once

#include <array>
#include <memory>

#include "fbvins/doctor/evidence.hpp"
#include "fbvins/doctor/imu_series.hpp"
#include "fbvins/features/pyramid.hpp"

namespace fbvins {

/// Keeps small images between which the scene moved, at most as many as memory allows, spread over the recording.
class ViewSampler {
 public:
  /// Of a pair views need both images.
  explicit ViewSampler(bool of_a_pair = true) : of_a_pair_(of_a_pair) {}
  /// `moved_px`: motion of the scene in the left image since the image before. An image that is missing has an empty pyramid.
  void add(Time t, const Vec2& moved_px, const Pyramid& left, const Pyramid& right);
  /// The motion since the image before is not known.
  void interrupt() { known_ = false; }
  std::vector<SmallView> take() { return std::move(views_); }

 private:
  bool of_a_pair_;
  std::vector<SmallView> views_;
  Vec2 moved_px_ = Vec2::Zero();  // since the last view
  bool known_ = true;
  int stride_ = 1, skipped_ = 0;  // views that were due for each that is kept; and since the last one
};

struct FixedInView {
  int pairs = 0;  ///< of views between which the scene moved and the rig turned
  /// Left, right; what the calibration's mask hides already included. Null where nothing else is fixed.
  std::array<std::shared_ptr<const Mask>, 2> masks = {};
  std::array<double, 2> share = {};  ///< of the image, without what was hidden already

  bool judged() const;
  bool any() const { return masks[0] != nullptr || masks[1] != nullptr; }
};

FixedInView find_fixed(const Evidence& evidence, const ImuSeries& imu);

}  // namespace fbvins
