// SPDX-License-Identifier: Apache-2.0
// The left camera's images of the last keyframes of a flight, of which one shows, from another place, what the newest one shows:
// a second view where there is no other camera (docs/derivations/loop.md, L30 and L31). Images are shared, not copied. One
// thread at a time.
//
//   EarlierViews views(rig);
//   if (auto view = views.best_for(keyframe, T_GC)) depths.set(keyframe.images.left()->view(), view->image->view(), view->from);
//   views.add(keyframe, T_GC);
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/loop/second_view.hpp"
#include "fbvins/types/keyframe.hpp"

namespace fbvins {

struct EarlierView {
  std::shared_ptr<const Image> image;
  SecondView from;  ///< with the lens of these views
};

class EarlierViews {
 public:
  explicit EarlierViews(const StereoRig& rig) : lens_(rig.left()), T_BC0_(rig.T_BC0()) {}

  /// The one in which most of the keyframe's landmarks are seen with a depth; `T_GC`: the camera when it took its image. None
  /// where no view shows enough of them from far enough away: after a restart of the odometry, in a turn on the spot, in a long
  /// hover.
  std::optional<EarlierView> best_for(const Keyframe& keyframe, const Pose<G, C0>& T_GC) const;
  /// For keyframes to come. Those of another reset counter are forgotten; a keyframe that shows what the newest view does is
  /// none.
  void add(const Keyframe& keyframe, const Pose<G, C0>& T_GC);

 private:
  struct Seen {
    Time t;
    std::shared_ptr<const Image> image;
    Pose<G, C0> T_GC;
  };

  SecondView from(const Seen& seen, const Pose<G, C0>& T_GC) const;
  double worth(const SecondView& view, const std::vector<Vec3>& points_C0) const;

  Camera lens_;
  Pose<B, C0> T_BC0_;
  std::uint32_t reset_counter_ = 0;
  std::deque<Seen> seen_;
};

}  // namespace fbvins
