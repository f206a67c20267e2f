// SPDX-License-Identifier: Apache-2.0
// Simulated rooms and the same rooms again under every change of bench/place_changes, as places of several kinds of descriptors.
#pragma once

#include <array>
#include <deque>
#include <stdexcept>
#include <string>
#include <vector>

#include "fbvins/features/booster.hpp"
#include "fbvins/loop/place_extractor.hpp"
#include "fbvins/sim/still_room.hpp"

namespace fbvins {

inline constexpr double kMapEvery_s = 1;
inline constexpr std::size_t kQueryEvery = 3;  // views of the map; a query lies between two of them

struct RoomCondition {
  const char* name;
  RoomChange room;
  ViewChange view;
};
/// Fixed before anything was measured.
inline constexpr std::array kConditions = {
    RoomCondition{"nothing", {}, {}},
    RoomCondition{"half of the lamps", {.lamps = LampChange::half}, {}},
    RoomCondition{"standing lamps", {.lamps = LampChange::standing}, {}},
    RoomCondition{"sun", {.lamps = LampChange::sun}, {}},
    RoomCondition{"4 % of the light", {.level = 0.04, .exposure = 0.35}, {}},
    RoomCondition{"over-exposed", {.exposure = 1.7}, {}},
    RoomCondition{"10 % of the furniture", {.moved_share = 0.1}, {}},
    RoomCondition{"30 % of the furniture", {.moved_share = 0.3}, {}},
    RoomCondition{"60 % of the furniture", {.moved_share = 0.6}, {}},
    RoomCondition{"turned by 20 degrees", {}, {.turned_deg = 20}},
    RoomCondition{"turned by 40 degrees", {}, {.turned_deg = 40}},
    RoomCondition{"turned by 60 degrees", {}, {.turned_deg = 60}},
    RoomCondition{"1 m higher", {}, {.higher_m = 1}},
    RoomCondition{"1 m lower", {}, {.higher_m = -1}},
    RoomCondition{"standing lamps, turned by 20", {.lamps = LampChange::standing}, {.turned_deg = 20}},
    RoomCondition{"sun, 30 % of the furniture", {.lamps = LampChange::sun, .moved_share = 0.3}, {}},
    RoomCondition{"standing lamps, 30 %, dim, turned by 20",
                  {.lamps = LampChange::standing, .moved_share = 0.3, .level = 0.1, .exposure = 0.6},
                  {.turned_deg = 20}},
};

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
struct SeenRoom {
  std::vector<SeenView> map;
  std::array<std::vector<SeenView>, kConditions.size()> again;
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

/// Views between those of the map, from where the change puts them; turned to one side and the other by turns, or to the only
/// side where there is room.
inline std::vector<Pose<W, B>> query_poses(const StillRoom& still, const ViewChange& change) {
  std::vector<Pose<W, B>> poses;
  for (std::size_t i = 1, side = 0; i < still.views().size(); i += 2 * kQueryEvery, ++side) {
    ViewChange view = change;
    if (side % 2) view.turned_deg *= -1;
    auto pose = still.seen_from(still.views()[i], view);
    view.turned_deg *= -1;
    if (!pose) pose = still.seen_from(still.views()[i], view);
    if (pose) poses.push_back(*pose);
  }
  return poses;
}

/// `seed`: of the room; every fourth `index` is a hall.
inline SeenRoom look_at_room(int seed, std::size_t index, int samples, const std::vector<DescriptorKind>& kinds) {
  SimulationOptions options = *simulation_preset(index % 4 == 3 ? "hall" : "normal");
  options.seed = seed;
  options.camera.time_samples = samples;
  const auto still = StillRoom::build(options, 0.5 * kMapEvery_s);
  if (!still) throw std::runtime_error(still.error().message);
  RoomLooker looker(*still, kinds);
  std::vector<Pose<W, B>> of_map;
  for (std::size_t i = 0; i < still->views().size(); i += 2) of_map.push_back(still->views()[i]);
  SeenRoom room;
  room.map = looker.see(of_map, {});
  for (std::size_t c = 0; c < kConditions.size(); ++c) {
    RoomChange change = kConditions[c].room;
    change.seed = static_cast<int>(c) + 1;
    room.again[c] = looker.see(query_poses(*still, kConditions[c].view), change);
  }
  return room;
}

}  // namespace fbvins
