// SPDX-License-Identifier: Apache-2.0
// A simulated room that is seen again: still images from any pose, after what has changed. Everything follows from the options
// and the seeds. One thread at a time; rooms are independent.
//
//   Result<StillRoom> room = StillRoom::build(options, 1.0);
//   auto first = room->render(room->views(), {});
//   auto again = room->render({*room->seen_from(room->views()[3], {.turned_deg = 40})}, {.lamps = LampChange::sun});
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "fbvins/sim/room_changes.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {

struct RoomChange {
  LampChange lamps = LampChange::none;
  double moved_share = 0;  ///< of the furniture
  double level = 1;        ///< brightness of all light
  double exposure = 1;     ///< mean grey value of the images, relative to the options' target
  int seed = 0;            ///< where furniture and lamps go, and of the images' noise
};

/// Where a place is seen from, relative to before.
struct ViewChange {
  double turned_deg = 0;  ///< the camera has gone about a point ahead, which it still looks at
  double higher_m = 0;
};

class StillRoom {
 public:
  /// Views along a flight, one every `every_s`, in a room around it; options of the kinds room and hall.
  static Result<StillRoom> build(const SimulationOptions& options, double every_s);

  const StereoRig& rig() const { return rig_; }
  const std::vector<Pose<W, B>>& views() const { return views_; }
  /// Empty where there is no room for a camera.
  std::optional<Pose<W, B>> seen_from(const Pose<W, B>& view, const ViewChange& change) const;
  /// Images from `poses` in turn; the exposure follows from one to the next.
  std::vector<RenderedFrame> render(const std::vector<Pose<W, B>>& poses, const RoomChange& change,
                                    bool with_depth = false) const;

 private:
  StillRoom() = default;

  SimulationOptions options_;
  StereoRig rig_;
  std::vector<Vec3> path_;
  std::vector<Pose<W, B>> views_;
  std::shared_ptr<const World> world_;
};

}  // namespace fbvins
