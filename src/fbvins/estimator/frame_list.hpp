// SPDX-License-Identifier: Apache-2.0
// The frames of the sliding window, oldest first, found by their id. A value.
#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/estimator/factor.hpp"
#include "fbvins/imu/nav_state.hpp"
#include "fbvins/imu/preintegration.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// A frame of the window. `imu` joins it to the frame before it in the window; it is replaced, never modified, so that
/// window problems can share it.
struct Frame {
  FrameId id;
  Time t;
  NavState<G> state;
  NavState<G> first_estimate;
  bool in_prior = false;
  bool keyframe = false;
  std::shared_ptr<const Preintegration> imu;
  std::vector<FrameFactor> factors;  ///< beside the readings'; by order
  std::shared_ptr<const DepthImage> depth;
  StereoFrame images;  ///< of keyframes, until they have been handed on
};

class FrameList {
 public:
  int size() const { return static_cast<int>(frames_.size()); }
  bool empty() const { return frames_.empty(); }
  const Frame& operator[](int index) const { return frames_[static_cast<std::size_t>(index)]; }
  Frame& operator[](int index) { return frames_[static_cast<std::size_t>(index)]; }
  auto begin() const { return frames_.begin(); }
  auto end() const { return frames_.end(); }
  auto begin() { return frames_.begin(); }
  auto end() { return frames_.end(); }
  const Frame& oldest() const { return frames_.front(); }
  const Frame& newest() const { return frames_.back(); }
  Frame& newest() { return frames_.back(); }

  /// -1 where there is none.
  int index_of(FrameId id) const {
    const auto it = std::lower_bound(frames_.begin(), frames_.end(), id, [](const Frame& f, FrameId i) { return f.id < i; });
    return it != frames_.end() && it->id == id ? static_cast<int>(it - frames_.begin()) : -1;
  }
  /// Of a frame that is in the window.
  const Frame& at(FrameId id) const { return (*this)[index_of(id)]; }

  void add(Frame frame) { frames_.push_back(std::move(frame)); }
  void remove(int index) { frames_.erase(frames_.begin() + index); }
  void clear() { frames_.clear(); }

 private:
  std::vector<Frame> frames_;
};

}  // namespace fbvins
