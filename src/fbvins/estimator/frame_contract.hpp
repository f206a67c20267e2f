// SPDX-License-Identifier: Apache-2.0
// The border between frontend and estimator: what a frontend, perhaps a user's own, must hold to. A track comes once in a frame;
// a feature is seen by at least one camera, by cameras of the rig, and once by each; all numbers of an observation are finite.
// Features that break this are left out, and counted; stereo matches that the frontend did not count are. Buffers are reused; one
// instance, one thread.
//
//   const TrackedFrame& frame = contract.enforced(tracked, cameras_of_rig);
//   if (contract.broken() > 0) ...
#pragma once

#include <vector>

#include "fbvins/types/tracking.hpp"

namespace fbvins {

class FrameContract {
 public:
  /// The frame itself where it holds to the contract, else a copy that does, valid until the next call.
  const TrackedFrame& enforced(const TrackedFrame& frame, int cameras);
  /// Features left out of the last frame.
  int broken() const { return broken_; }

 private:
  bool any_twice(const std::vector<TrackedFeature>& features);

  std::vector<TrackId> ids_;
  TrackedFrame accepted_;
  int broken_ = 0;
};

}  // namespace fbvins
