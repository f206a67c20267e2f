// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/landmark_table.hpp"

#include <algorithm>

namespace fbvins {
namespace {

/// Outlier counts are kept of so many tracks, the newest.
constexpr std::size_t kMaxOutlierCounts = 20000;

}  // namespace

std::span<const Sighting> Landmark::seen_by_cameras(FrameId frame) const {
  const auto is_of_it = [&](const Sighting& s) { return s.frame == frame; };
  const auto first = std::find_if(observations.begin(), observations.end(), is_of_it);
  return {first, std::find_if_not(first, observations.end(), is_of_it)};
}

int Landmark::frame_count() const {
  int frames = 0;
  for (std::size_t i = 0; i < observations.size(); ++i) frames += i == 0 || observations[i].frame != observations[i - 1].frame;
  return frames;
}

void LandmarkTable::clear() {
  landmarks_.clear();
  index_of_track_.clear();
  outlier_counts_.clear();
}

Landmark* LandmarkTable::find(LandmarkId id) {
  const auto it =
      std::lower_bound(landmarks_.begin(), landmarks_.end(), id, [](const Landmark& l, LandmarkId i) { return l.id < i; });
  return it != landmarks_.end() && it->id == id ? &*it : nullptr;
}

const Landmark* LandmarkTable::find(TrackId track) const {
  const auto it = index_of_track_.find(track);
  return it == index_of_track_.end() ? nullptr : &landmarks_[static_cast<std::size_t>(it->second)];
}

std::pair<Landmark&, bool> LandmarkTable::of_track(TrackId track) {
  const auto [it, is_new] = index_of_track_.try_emplace(track, static_cast<int>(landmarks_.size()));
  if (is_new) {
    Landmark landmark;
    landmark.id = LandmarkId{next_id_++};
    landmark.track = track;
    const auto outlier_count = outlier_counts_.find(track);
    if (outlier_count != outlier_counts_.end()) landmark.outlier_count = outlier_count->second;
    landmarks_.push_back(std::move(landmark));
  }
  return {landmarks_[static_cast<std::size_t>(it->second)], is_new};
}

void LandmarkTable::remove_unseen() {
  std::size_t out = 0;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    if (landmarks_[i].observations.empty()) {
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

void LandmarkTable::keep_outlier_count(const Landmark& landmark) {
  outlier_counts_[landmark.track] = landmark.outlier_count;
  if (outlier_counts_.size() > kMaxOutlierCounts) outlier_counts_.erase(outlier_counts_.begin());
}

bool LandmarkTable::rejected(TrackId track) const {
  const auto outlier_count = outlier_counts_.find(track);
  return outlier_count != outlier_counts_.end() && outlier_count->second >= kOutliersUntilRejected;
}

}  // namespace fbvins
