// SPDX-License-Identifier: Apache-2.0
// The tracks that frames of the sliding window see, and the points they show. Found by id and by track; no geometry
// (that is landmark_geometry.hpp). A value.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/estimator/landmark_prior.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// A landmark seen from one frame.
struct Sighting {
  FrameId frame;
  Observation left;
  std::optional<Observation> right;
  Vec2 left_velocity = Vec2::Zero();  ///< of the normalised position, 1/s
  Vec2 right_velocity = Vec2::Zero();
};

/// A track and, once triangulated, the point it shows.
struct Landmark {
  LandmarkId id;
  TrackId track;
  FrameId host;
  Vec3 alpha_beta_rho = Vec3::Zero();
  bool triangulated = false;
  std::optional<LandmarkPrior> prior;  ///< of one that was known before
  int strikes = 0;                     ///< times an observation of it was thrown out
  std::vector<Sighting> sightings;     ///< oldest first; one without any is removed

  bool seen_in(FrameId frame) const { return sighting_in(frame) != nullptr; }
  const Sighting* sighting_in(FrameId frame) const;
};

class LandmarkTable {
 public:
  /// Ids go on where they were.
  void clear();
  const std::vector<Landmark>& all() const { return landmarks_; }
  std::vector<Landmark>& all() { return landmarks_; }

  /// Null where there is none.
  Landmark* find(LandmarkId id);
  const Landmark* find(LandmarkId id) const { return const_cast<LandmarkTable*>(this)->find(id); }
  /// The landmark of a track, and whether it is a new one.
  std::pair<Landmark&, bool> of_track(TrackId track);
  /// Removes landmarks whose sightings have all been taken away.
  void remove_unseen();

  /// Tracks that proved wrong keep their strikes; three, and they are not followed any more.
  void keep_strikes(const Landmark& landmark);
  bool banned(TrackId track) const;
  static constexpr int kStrikesUntilBanned = 3;

 private:
  std::vector<Landmark> landmarks_;  ///< ids ascend
  std::unordered_map<TrackId, int> index_of_track_;
  std::map<TrackId, int> strikes_;
  std::int64_t next_id_ = 0;
};

}  // namespace fbvins
