// SPDX-License-Identifier: Apache-2.0
// The tracks in the frames of the sliding window and their landmarks, found by id and by track. No geometry
// (that is landmark_geometry.hpp). A value.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/estimator/landmark_prior.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// A landmark seen by one camera in one frame.
struct Sighting {
  FrameId frame;
  Observation seen;
  Vec2 velocity = Vec2::Zero();  ///< of the normalised position, 1/s
};

/// A track and, once triangulated, its 3-D point.
struct Landmark {
  LandmarkId id;
  TrackId track;
  int lead = 0;  ///< the camera that the track is followed in
  FrameId host;
  int ray_camera = 0;  ///< of the host, on whose ray it is: the lead, or another one where the lead did not see it
  Vec3 alpha_beta_rho = Vec3::Zero();
  bool triangulated = false;
  std::optional<LandmarkPrior> prior;  ///< of a re-observed one
  int outlier_count = 0;               ///< solves after which observations of it were removed as outliers
  /// The oldest frame's first, in each frame the lead's; a landmark without any is removed.
  std::vector<Sighting> observations;

  bool seen_in(FrameId frame) const { return !seen_by_cameras(frame).empty(); }
  std::span<const Sighting> seen_by_cameras(FrameId frame) const;
  /// In the newest frame that saw it.
  std::span<const Sighting> newest() const { return seen_by_cameras(observations.back().frame); }
  bool by_several_frames() const { return !observations.empty() && observations.front().frame != observations.back().frame; }
  /// How many frames saw it.
  int frame_count() const;
};

class LandmarkTable {
 public:
  /// Ids are not used again.
  void clear();
  const std::vector<Landmark>& all() const { return landmarks_; }
  std::vector<Landmark>& all() { return landmarks_; }

  /// Null where there is none.
  Landmark* find(LandmarkId id);
  const Landmark* find(LandmarkId id) const { return const_cast<LandmarkTable*>(this)->find(id); }
  const Landmark* find(TrackId track) const;
  /// The landmark of a track, and whether it is a new one.
  std::pair<Landmark&, bool> of_track(TrackId track);
  /// Removes landmarks without observations.
  void remove_unseen();

  /// Remembers the outlier count of a track whose landmark is removed; after three the track is ignored.
  void keep_outlier_count(const Landmark& landmark);
  bool rejected(TrackId track) const;
  static constexpr int kOutliersUntilRejected = 3;

 private:
  std::vector<Landmark> landmarks_;  ///< ids ascend
  std::unordered_map<TrackId, int> index_of_track_;
  std::map<TrackId, int> outlier_counts_;
  std::int64_t next_id_ = 0;
};

}  // namespace fbvins
