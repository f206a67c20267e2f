// SPDX-License-Identifier: Apache-2.0
// A map beside the odometry: recognises places, estimates the pose of W in M, and is saved and loaded.
//
//   auto map = LoopMap::create(rig, {.file = "monday.fbm"});                           // to continue; {}: a new map
//   if (!map) return report(map.error().message);
//   auto system = System::create(options, rig, RunMode::threaded, {.mapper = map->get()});
//   system->on_map_update([&](const MapUpdate& u) { T_MW = u.T_MW; });                 // T_MB = T_MW * T_WB
//   ...                                                                                // push the flight, finish() the system
//   (*map)->finish();
//   Result<void> saved = (*map)->save("flat.fbm");
//
// The pipeline calls process() from one thread; everything else is called before the first keyframe or after the system's
// finish(). The same keyframes give the same bytes in the file. Of a loaded map the places are read from the file when they are
// needed, and at most LoopOptions::memory_mb of them are kept; adjust() reads all.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/loop/loop_options.hpp"
#include "fbvins/loop/map_report.hpp"
#include "fbvins/types/gauge.hpp"
#include "fbvins/types/mapper.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins {

class LoopCloser;
class MapJournal;

struct MapOptions {
  std::string file = {};        ///< a map to relocalise in and continue; empty: a new one, in which M begins where W does
  std::string vocabulary = {};  ///< file of visual words, instead of those that ship
  bool boosted = false;         ///< a new map of descriptors that the network improves; a loaded map has its own kind
  LoopOptions loop = {};
};

class LoopMap final : public Mapper {
 public:
  /// Of a rig of more than two cameras the map has the places that its pairs see, in turns; of cameras that all see different
  /// things, those of all of them. An error where an option is out of range, or the map, the vocabulary or the network cannot be
  /// read or do not belong together.
  static Result<std::unique_ptr<LoopMap>> create(const StereoRig& rig, const MapOptions& options = {});
  ~LoopMap() override;

  MapUpdate process(const Keyframe& keyframe) override;

  /// Goes on with another map: this one is forgotten. On the thread of process(); the flight is localised anew.
  void take_over(std::unique_ptr<LoopMap> other);
  /// Last optimisation of the pose graph, once the flight is over. From a map that was continued, what the flight makes
  /// superfluous is removed.
  PoseGraphReport finish();
  /// After finish(), where the best map is worth minutes: bundle adjustment over all of it.
  FinalAdjustmentReport adjust();

  /// Poses of a flight (in one gauge: Odometry::gauge.T_GB between two restarts) as the map has them now: exact at keyframes,
  /// interpolated between them. Empty where the flight was never localised in the map.
  Trajectory<M> corrected(const Trajectory<G>& in_G) const;
  /// Keyframes in the map now.
  int keyframes() const;
  /// Parts of the flight, between restarts, that were localised in an older map but do not fit it, and why, by
  /// MapUpdate::map_session. They are no part of the file, and the older map is in it as it was.
  std::map<std::uint32_t, std::string> not_joined() const;
  /// What of the loaded file could not be read when it was needed, and was passed over: a sentence; empty: nothing.
  std::string damage() const;
  /// Bytes of the file that save() writes, all of them; may be called on the thread of process(), too. An error where a part of
  /// the loaded file is needed and cannot be read.
  Result<std::string> bytes() const;
  /// To keep the map in flight, on the thread of process(): bytes for the journal beside the loaded file, of what is new since
  /// the last call (src/fbvins/loop/map_journal.hpp); empty: nothing. `anew`: the last ones were lost. Errors as of bytes().
  Result<std::string> news(bool anew);
  /// Replaces the file atomically, also the loaded one: there is never half of one. Errors as of bytes(), which it needs no
  /// memory for.
  Result<void> save(const std::string& path) const;

 private:
  explicit LoopMap(std::unique_ptr<LoopCloser> closer);

  std::unique_ptr<LoopCloser> closer_;
  std::unique_ptr<MapJournal> journal_;
};

}  // namespace fbvins
