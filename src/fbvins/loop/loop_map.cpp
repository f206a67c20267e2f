// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/loop_map.hpp"

#include "fbvins/core/options.hpp"
#include "fbvins/features/booster.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/map_front.hpp"
#include "fbvins/loop/map_journal.hpp"
#include "fbvins/loop/place_store.hpp"
#include "fbvins/loop/vocabulary_file.hpp"

namespace fbvins {

Result<std::unique_ptr<LoopMap>> LoopMap::create(const StereoRig& rig, const MapOptions& options) {
  if (Result<void> valid = validate(options.loop); !valid) return valid.error();
  Result<PlaceMap> map = PlaceMap{};
  constexpr std::uint64_t kMB = 1'000'000;
  if (!options.file.empty()) map = open_map(options.file, kMB * static_cast<std::uint64_t>(options.loop.memory_mb));
  if (!map) return map.error();
  if (map->empty()) map->boosted = options.boosted;
  auto vocabulary = open_vocabulary(map->boosted ? kBoostedDescriptors : kRawDescriptors, options.vocabulary);
  if (!vocabulary) return vocabulary.error();
  if (map->vocabulary != vocabulary->fingerprint())
    if (Result<void> all = read_places(*map); !all) return all.error();
  Result<std::unique_ptr<DescriptorStage>> stage = make_identity_stage();
  if (map->boosted) stage = make_booster_stage(BoosterOptions{});
  if (!stage) return stage.error();
  auto closer = std::make_unique<LoopCloser>(rig, options.loop, std::move(*vocabulary), std::move(*map), std::move(*stage));
  return std::unique_ptr<LoopMap>(new LoopMap(std::move(closer)));
}

LoopMap::LoopMap(std::unique_ptr<LoopCloser> closer) : closer_(std::move(closer)), journal_(std::make_unique<MapJournal>()) {}
LoopMap::~LoopMap() = default;

MapUpdate LoopMap::process(const Keyframe& keyframe) { return closer_->process(keyframe); }
void LoopMap::take_over(std::unique_ptr<LoopMap> other) {
  closer_ = std::move(other->closer_);
  journal_ = std::move(other->journal_);
}
PoseGraphReport LoopMap::finish() { return closer_->finish(); }
FinalAdjustmentReport LoopMap::adjust() { return closer_->adjust(); }
Trajectory<M> LoopMap::corrected(const Trajectory<G>& in_G) const { return closer_->corrected(in_G); }
int LoopMap::keyframes() const { return static_cast<int>(closer_->map().size()); }
std::map<std::uint32_t, std::string> LoopMap::not_joined() const { return closer_->objections(); }
Result<std::string> LoopMap::bytes() const {
  const std::optional<PlaceMap> reduced = closer_->reduced();
  return map_bytes(reduced ? *reduced : closer_->map());
}
Result<std::string> LoopMap::news(bool anew) {
  if (anew) journal_->begin_anew();
  const std::optional<PlaceMap> reduced = closer_->reduced();
  return journal_->news(reduced ? *reduced : closer_->map());
}
Result<void> LoopMap::save(const std::string& path) const {
  const std::optional<PlaceMap> reduced = closer_->reduced();
  return save_map(reduced ? *reduced : closer_->map(), path);
}
std::string LoopMap::damage() const {
  const std::shared_ptr<PlaceStore>& store = closer_->map().store;
  return store && store->damage() ? store->damage()->message : std::string();
}

}  // namespace fbvins
