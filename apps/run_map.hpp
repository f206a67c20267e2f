// SPDX-License-Identifier: Apache-2.0
// Loop closure in `fbvins run`: its arguments, and the three trajectories that result, which are kept apart:
// the odometry in W (written by run_output.hpp), in M as known at each moment, and in M after the run.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/run_output.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/loop/loop_map.hpp"
#include "fbvins/types/loop.hpp"

namespace CLI {
class App;
}

namespace fbvins::app {

struct MapArguments {
  bool loop = false, final_ba = false, boosted = false;
  std::string load, save, vocabulary;
  std::string positions = {}, tags = {};  ///< files of anchors
  /// The options that commands with maps share.
  void add_to(CLI::App& command);
  bool wanted() const { return loop || final_ba || !load.empty() || !save.empty() || !positions.empty() || !tags.empty(); }
};

/// Null if no loop closure is wanted. Errors: of the vocabulary, the old map, the folder of the new one.
Result<std::unique_ptr<LoopMap>> make_map(const MapArguments& arguments, const StereoRig& rig, const LoopOptions& options);

/// The updates of loop closure, keyframe by keyframe, and the final result.
struct MapRecord {
  std::vector<MapUpdate> updates;  ///< without the corrected keyframes
  Trajectory<M> causal, bounded;   ///< T_MB at each frame, with T_MG as it was known then; with the smooth T_MW
  Trajectory<M> final;             ///< after the last optimisation of the graph
  Trajectory<M> adjusted;          ///< after bundle adjustment, where asked for
  int keyframes_in_map = 0;
  PoseGraphReport graph;                ///< of the last optimisation
  double finish_ms = 0, adjust_ms = 0;  ///< CPU
  std::optional<FinalAdjustmentReport> adjustment;
  std::map<std::uint32_t, std::string> not_joined;  ///< sessions that are no part of the map's file, and why
  std::string not_saved;                            ///< why the map could not be written; empty: it was, or need not be
};

/// The anchors of --positions, in order of time; none without it.
Result<std::vector<Anchor>> positions_of(const MapArguments& arguments);
/// The map itself or, with --tags, one that finds them in its keyframes, which is kept in `with_tags`.
Result<Mapper*> mapper_of(const MapArguments& arguments, const StereoRig& rig, LoopMap* map, std::unique_ptr<Mapper>& with_tags);

/// Ends the map (last optimisation, bundle adjustment where asked for) and composes the trajectories.
void finish_map(const MapArguments& arguments, LoopMap& map, const RunRecord& run, MapRecord& record);
Result<void> save_map(const MapArguments& arguments, const LoopMap& map);
/// map_trajectory_tum.txt (the most accurate), map_causal_tum.txt, map_bounded_tum.txt, map_updates.csv.
Result<void> write_map_record(const MapRecord& record, const std::string& folder);

/// Counts, times, and errors of the trajectories where there is ground truth.
struct MapSummary {
  std::string loaded = {};  ///< the file of the map that was there before the flight; empty: none
  int keyframes = 0, keyframes_in_map = 0, loops = 0, refused = 0, left_out = 0;
  int anchors = 0, anchors_refused = 0, anchors_left_out = 0;
  std::optional<double> anchored_after_s;   ///< from the first pose to the first known T_MW of an anchored map
  std::optional<double> localised_after_s;  ///< from the first pose to the first known T_MW
  struct Found {
    double restart_s, after_s;  ///< when the odometry started again, from the first pose; until it was localised again
  };
  std::vector<Found> found_again;
  std::map<std::uint32_t, std::string> not_joined;
  std::optional<Evaluation> causal, bounded, final, adjusted;
  double mean_ms = 0, finish_ms = 0, adjust_ms = 0;  ///< CPU: of a keyframe, at the end, of the bundle adjustment
  std::optional<FinalAdjustmentReport> adjustment;
};
/// `truth` may be empty.
MapSummary summarise(const MapRecord& record, const RunRecord& run, const Trajectory<W>& truth);

}  // namespace fbvins::app
