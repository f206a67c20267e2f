// SPDX-License-Identifier: Apache-2.0
// Views of a simulated room as places of several kinds of descriptors.
#pragma once

#include <deque>
#include <stdexcept>
#include <string>
#include <vector>

#include "fbvins/features/booster.hpp"
#include "fbvins/loop/place_extractor.hpp"
#include "fbvins/sim/still_room.hpp"

namespace fbvins {

/// One kind of descriptors.
struct DescriptorKind {
  std::string name, weights;
  Vocabulary vocabulary;

  bool is_boosted() const { return !weights.empty(); }
};

/// A view with a place of every kind.
struct SeenView {
  Pose<W, B> T_WB;
  std::vector<Place> places;
};
/// Extracts the places of one room. One thread.
class RoomLooker {
 public:
  RoomLooker(const StillRoom& still, const std::vector<DescriptorKind>& kinds) : still_(still) {
    for (const DescriptorKind& kind : kinds) {
      auto stage = kind.is_boosted() ? make_booster_stage({.weights = kind.weights}) : Result(make_identity_stage());
      if (!stage) throw std::runtime_error(stage.error().message);
      extractors_.emplace_back(still.rig(), PlaceExtractorOptions{}, kind.vocabulary, *std::move(stage));
    }
  }

  std::vector<SeenView> see(const std::vector<Pose<W, B>>& poses, const RoomChange& change) {
    std::vector<SeenView> seen;
    if (poses.empty()) return seen;
    const std::vector<RenderedFrame> frames = still_.render(poses, change);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      seen.push_back({poses[i], {}});
      for (PlaceExtractor& extractor : extractors_)
        seen.back().places.push_back(extractor.extract(frames[i].frame, poses[i].R()));
    }
    return seen;
  }

 private:
  const StillRoom& still_;
  std::deque<PlaceExtractor> extractors_;
};

}  // namespace fbvins
