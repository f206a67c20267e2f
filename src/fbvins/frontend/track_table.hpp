// SPDX-License-Identifier: Apache-2.0
// The features that are being followed: the state of a track that all frontends have, and the table of tracks with their
// patches. Patches are large, are made when so many tracks are there for the first time, and stay in place; tracks are small and
// are moved. One instance, one thread.
//
//   TrackTable<KltTrack, KltPatches> tracks(150);
//   if (!tracks.full() && tracks.free_patches().newest.cut(left, px, 0, 3)) tracks.start(track);
//   for (KltTrack& track : tracks) if (!follow(track, tracks.patches(track))) track.status = TrackStatus::lost;
//   tracks.drop_ended();
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// Whether a track goes on. One whose feature went out of view may be re-observed; a lost one may not.
enum class TrackStatus : std::uint8_t { active, out_of_view, lost };

struct TrackState {
  TrackId id;
  std::size_t slot = 0;            ///< of its patches
  Vec2 px = Vec2::Zero();          ///< in the newest left image; predicted, while it is not observed
  Vec2 normalised = Vec2::Zero();  ///< the same in C0
  Vec2 previous_px = Vec2::Zero();
  Vec2 previous_normalised = Vec2::Zero();
  std::optional<double> inverse_depth;  ///< 1/m along z of C0, from the last stereo match, carried to the newest image
  std::optional<double> previous_inverse_depth;
  std::optional<Observation> right;  ///< match in the newest right image
  int age_frames = 0;
  bool observed = true;  ///< has an observation in the newest image
  TrackStatus status = TrackStatus::active;
};

template <class Track, class Patches>
class TrackTable {
 public:
  explicit TrackTable(int capacity) : capacity_(static_cast<std::size_t>(capacity)) {}

  auto begin() { return tracks_.begin(); }
  auto end() { return tracks_.end(); }
  auto begin() const { return tracks_.begin(); }
  auto end() const { return tracks_.end(); }
  std::size_t size() const { return tracks_.size(); }
  Track& operator[](std::size_t i) { return tracks_[i]; }
  const Track& operator[](std::size_t i) const { return tracks_[i]; }
  Patches& patches(const Track& track) { return patches_[track.slot]; }
  const Patches& patches(const Track& track) const { return patches_[track.slot]; }

  bool full() const { return free_.empty() && patches_.size() == capacity_; }
  /// The patches of the next track to start: cut them first, and start the track only if that succeeded. Not of a full table.
  Patches& free_patches() { return patches_[free_slot()]; }
  std::int64_t next_id() const { return next_id_; }
  void begin_ids_at(std::int64_t id) { next_id_ = std::max(next_id_, id); }
  /// Adds a track with a new id.
  Track& start(Track track) {
    track.id = TrackId{next_id_++};
    return resume(std::move(track));
  }
  /// Adds a track with the id that it has.
  Track& resume(Track track) {
    track.slot = free_slot();
    free_.pop_back();
    return tracks_.emplace_back(std::move(track));
  }

  /// Removes tracks that are not active, after calling `on_end(track, patches)` for each.
  template <class OnEnd>
  void drop_ended(OnEnd&& on_end) {
    for (const Track& track : tracks_) {
      if (track.status == TrackStatus::active) continue;
      on_end(track, std::as_const(patches_[track.slot]));
      free_.push_back(track.slot);
    }
    std::erase_if(tracks_, [](const Track& track) { return track.status != TrackStatus::active; });
  }
  void drop_ended() {
    drop_ended([](const Track&, const Patches&) {});
  }
  void end_all(TrackStatus status) {
    for (Track& track : tracks_) track.status = status;
  }

 private:
  std::size_t free_slot() {
    assert(!full());
    if (free_.empty()) {
      free_.push_back(patches_.size());
      patches_.emplace_back();
    }
    return free_.back();
  }

  std::size_t capacity_;
  std::vector<Track> tracks_;
  std::deque<Patches> patches_;
  std::vector<std::size_t> free_;
  std::int64_t next_id_ = 0;
};

}  // namespace fbvins
