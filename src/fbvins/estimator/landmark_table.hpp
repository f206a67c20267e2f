// SPDX-License-Identifier: Apache-2.0
// The tracks in the frames of the sliding window and their landmarks, found by id and by track. No geometry
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

/// The observations of a landmark by the two cameras of its group in one frame, one at least.
struct StereoObservation {
  FrameId frame;
  std::optional<Observation> left, right;
  Vec2 left_velocity = Vec2::Zero();  ///< of the normalised position, 1/s
  Vec2 right_velocity = Vec2::Zero();
};

/// A track and, once triangulated, its 3-D point.
struct Landmark {
  LandmarkId id;
  TrackId track;
  CameraPair cameras;
  FrameId host;
  bool right_ray = false;  ///< on a ray of the host's right camera: the left one did not see it
  Vec3 alpha_beta_rho = Vec3::Zero();
  bool triangulated = false;
  std::optional<LandmarkPrior> prior;           ///< of a re-observed one
  int outlier_count = 0;                        ///< solves after which observations of it were removed as outliers
  std::vector<StereoObservation> observations;  ///< oldest first; a landmark without any is removed

  int ray_camera() const { return cameras[right_ray]; }
  bool seen_in(FrameId frame) const { return observation_in(frame) != nullptr; }
  const StereoObservation* observation_in(FrameId frame) const;
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
