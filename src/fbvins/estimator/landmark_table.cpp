// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/landmark_table.hpp"

#include <algorithm>

namespace fbvins {
namespace {

/// Of so many tracks with outliers, the newest, the strikes are kept.
constexpr std::size_t kMaxTracksWithStrikes = 20000;

}  // namespace

const Sighting* Landmark::sighting_in(FrameId frame) const {
  const auto it = std::find_if(sightings.begin(), sightings.end(), [&](const Sighting& s) { return s.frame == frame; });
  return it == sightings.end() ? nullptr : &*it;
}

void LandmarkTable::clear() {
  landmarks_.clear();
  index_of_track_.clear();
  strikes_.clear();
}

Landmark* LandmarkTable::find(LandmarkId id) {
  const auto it =
      std::lower_bound(landmarks_.begin(), landmarks_.end(), id, [](const Landmark& l, LandmarkId i) { return l.id < i; });
  return it != landmarks_.end() && it->id == id ? &*it : nullptr;
}

std::pair<Landmark&, bool> LandmarkTable::of_track(TrackId track) {
  const auto [it, is_new] = index_of_track_.try_emplace(track, static_cast<int>(landmarks_.size()));
  if (is_new) {
    Landmark landmark;
    landmark.id = LandmarkId{next_id_++};
    landmark.track = track;
    const auto strikes = strikes_.find(track);
    if (strikes != strikes_.end()) landmark.strikes = strikes->second;
    landmarks_.push_back(std::move(landmark));
  }
  return {landmarks_[static_cast<std::size_t>(it->second)], is_new};
}

void LandmarkTable::remove_unseen() {
  std::size_t out = 0;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    if (landmarks_[i].sightings.empty()) {
      index_of_track_.erase(landmarks_[i].track);
      continue;
    }
    if (out != i) {
      index_of_track_[landmarks_[i].track] = static_cast<int>(out);
      landmarks_[out] = std::move(landmarks_[i]);
    }
    ++out;
  }
  landmarks_.resize(out);
}

void LandmarkTable::keep_strikes(const Landmark& landmark) {
  strikes_[landmark.track] = landmark.strikes;
  if (strikes_.size() > kMaxTracksWithStrikes) strikes_.erase(strikes_.begin());
}

bool LandmarkTable::banned(TrackId track) const {
  const auto strikes = strikes_.find(track);
  return strikes != strikes_.end() && strikes->second >= kStrikesUntilBanned;
}

}  // namespace fbvins
