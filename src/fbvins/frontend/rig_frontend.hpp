// SPDX-License-Identifier: Apache-2.0
// The frontend of a rig with more cameras than one pair: a frontend for each group of cameras, whose features are one list, and
// whose number of features is the rig's. A track stays with its group. Tracks are numbered so that the number tells the group.
// Synchronous; one instance is used by one thread at a time.
//
//   RigFrontend frontend(camera_groups(rig), frontends, 150);   // one for each group, for rig_of(rig, group)
#pragma once

#include <memory>
#include <vector>

#include "fbvins/camera/camera_groups.hpp"
#include "fbvins/frontend/track_budget.hpp"
#include "fbvins/frontend/track_transfer.hpp"

namespace fbvins {

class RigFrontend final : public Frontend {
 public:
  /// `max_features`: that a rig of one group would follow.
  RigFrontend(std::vector<CameraGroup> groups, std::vector<std::unique_ptr<Frontend>> frontends, int max_features);

  TrackedFrame process(const SensorPacket& packet, const StatePrior& prior) override;
  void locate(const LandmarkUpdate& update) override;

 private:
  TrackId rig_wide(TrackId id, std::size_t group) const;
  void take_features(std::vector<TrackedFeature> features, std::size_t group, std::vector<TrackedFeature>& out) const;

  std::vector<CameraGroup> groups_;
  std::vector<std::unique_ptr<Frontend>> frontends_;
  TrackBudget budget_;
};

}  // namespace fbvins
