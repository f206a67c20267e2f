// SPDX-License-Identifier: Apache-2.0
// Finds in flight what covers a part of a lens: dirt, a drop, a leg. As the doctor does in a recording (FixedEdges): edges that
// stay at their pixels while the scene moves across them; at rest nothing moves, and nothing is said. What is found is masked for
// the frontend until it is gone. Deterministic; one instance, one thread, which is the frontend's.
//
//   LensWatch watch(rig);
//   auto frontend = make_frontend(watch.rig(), options);      // its cameras' masks change with what is found
//   TrackedFrame tracked = frontend->process(packet, prior);
//   watch.add(packet, prior, tracked);
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "fbvins/frontend/fixed_edges.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

class LensWatch {
 public:
  explicit LensWatch(const StereoRig& rig);

  /// The rig with masks that grow and shrink in flight, by add().
  const StereoRig& rig() const { return rig_; }
  /// A frame, and what the frontend found in it. Without a valid prior, whose bias the gyroscope's turns need, nothing is judged.
  void add(const SensorPacket& packet, const StatePrior& prior, const TrackedFrame& tracked);
  /// Pixels of the camera that are covered, beside those of its calibration's mask.
  int covered_px(int camera) const { return watched_[static_cast<std::size_t>(camera)].covered_px; }

 private:
  struct SeenAt {
    TrackId id;
    Vec2 px;
  };
  /// From a look to the next.
  struct Step {
    Vec2 moved_px = Vec2::Zero();
    Vec3 turned_B = Vec3::Zero();
    bool known = false;
  };
  struct Watched {
    FixedEdges fixed;
    std::shared_ptr<const Mask> own;                     // the calibration's
    std::shared_ptr<std::shared_ptr<const Mask>> shown;  // that rig() has
    Image edges = {}, covered = {};                      // small; black where fixed, as often as is enough
    Image times = {};                                    // small; of each pixel how often in a row an edge was fixed, up to that
    int covered_px = 0;
    Time looked = {};
    Step step = {.known = true};    // since that look
    std::vector<SeenAt> seen = {};  // then, by ascending id
    std::array<Step, kLooksApart> steps = {};
    int looks = 0;
  };
  void look(Watched& watched, int camera, const Image& image, const TrackedFrame& tracked);
  void judge(Watched& watched, const Camera& camera);

  StereoRig rig_;
  std::vector<Watched> watched_;
};

}  // namespace fbvins
