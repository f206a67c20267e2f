// SPDX-License-Identifier: Apache-2.0
// Improves descriptors (paper 2.2.2) where they are compared, and no others: of keypoints that resemble what is looked for, and
// of tracks that alignment no longer follows. Until then a track keeps what its descriptor is improved from.
// Does nothing where the stage changes none. Buffers are reused; one instance, one thread.
//
//   OrbImprover improver(stage);
//   improver.improve(tracks, view, [](const OrbTrack& track) { return !track.observed; });
//   improver.improve_similar(queries, view);       // then view.descriptor(k) is improved, where view.improved(k)
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "fbvins/frontend/orb_track.hpp"

namespace fbvins {

class OrbImprover {
 public:
  explicit OrbImprover(std::shared_ptr<DescriptorStage> stage) : stage_(std::move(stage)) {}

  /// The descriptors of those tracks of `which` that still are as extracted.
  template <class Which>
  void improve(OrbTracks& tracks, const OrbView& view, const Which& which) {
    inputs_.clear();
    for (const OrbTrack& track : tracks)
      if (track.unimproved && which(track)) inputs_.push_back(tracks.patches(track).input);
    if (inputs_.empty()) return;
    run(view);
    auto next = descriptors_.begin();
    for (OrbTrack& track : tracks)
      if (track.unimproved && which(track)) track.descriptor = *next++, track.unimproved = false;
  }
  /// The keypoints near a query that its descriptor as extracted resembles.
  void improve_similar(std::span<const GuidedQuery> queries, OrbView& view);

  /// CPU time since the last call, ms.
  double take_ms() { return std::exchange(ms_, 0.0); }

 private:
  void take_most_similar(OrbView& view);
  void run(const OrbView& view);

  std::shared_ptr<DescriptorStage> stage_;
  std::vector<DescriptorInput> inputs_;
  std::vector<Descriptor> descriptors_;
  std::vector<std::int32_t> near_, keypoints_;
  std::vector<std::uint16_t> distance_;
  std::vector<std::pair<std::uint16_t, std::int32_t>> similar_;  ///< distance to a query, and keypoint
  double ms_ = 0;
};

}  // namespace fbvins
