// SPDX-License-Identifier: Apache-2.0
// The map of a live flight, kept during the flight in a journal beside its file, so that a killed program leaves a map.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "apps/file_writer.hpp"
#include "apps/run_map.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/types/mapper.hpp"

namespace fbvins::app {

/// Runs on the thread of loop closure, where it takes the map's bytes; a thread of its own writes them. While a slow disk has not
/// finished one file no other is begun: the next one is of the newest map. Warns once of a file that cannot be written.
class KeptMap final : public Mapper {
 public:
  using Told = FileWriter::Told;

  /// Bytes for write_map_bytes().
  struct Source {
    std::function<Result<std::string>()> whole;          ///< LoopMap::bytes
    std::function<Result<std::string>(bool anew)> news;  ///< LoopMap::news
  };

  /// `file`, whose journal is kept, empty: the map is written only on request. `map` must outlive this.
  KeptMap(Mapper& map, Source bytes, std::string file, WriteFile write = write_map_bytes);
  MapUpdate process(const Keyframe& keyframe) override;

  /// Until the file being written is complete.
  void wait() const { writer_.wait(); }
  /// After the last keyframe: waits until the file being written is complete, and tells those who still wait for one that none
  /// comes. Nobody is told anything afterwards.
  void finish();
  /// To be called before the first keyframe: the file for requested maps. The kept one gets its journal brought up to date.
  void save_requested_to(std::string file) { requested_file_ = std::move(file); }
  /// The map is written after the next keyframe, once for all who have asked until then; `told` is called on the writer's thread.
  /// False: too many wait already. From any thread.
  bool request_save(Told told);
  /// On the thread of loop closure, before the next keyframe. False: something else waits for it already. From any thread.
  bool before_next_keyframe(std::function<void()> act);

 private:
  bool due(Time t);
  void write(const std::string& file, const Told& told);

  Mapper& map_;
  Source bytes_;
  std::string file_, requested_file_;
  Time written_;         ///< keyframe's time
  bool lost_ = false;    ///< the last news; while the writer is not idle, its thread's
  bool warned_ = false;  ///< on the writer's thread
  std::mutex mutex_;
  std::vector<Told> wanted_;          ///< guarded by mutex_
  std::function<void()> to_be_done_;  ///< guarded by mutex_
  FileWriter writer_;                 ///< last: its thread uses the members above
};

/// After a flight that found damage in the features of its map's file, which cannot be written again: the file and its journal
/// are set aside, and it is said.
void retire_kept_map(const std::string& file, const std::string& damage);

/// The map of `--map FILE`: continued if the file exists. An unusable file is set aside, said, and a new map begun; where that is
/// not possible either the flight keeps no map, and `arguments.save` becomes empty. Errors: those of the installation, as in
/// make_map.
Result<std::unique_ptr<LoopMap>> make_kept_map(MapArguments& arguments, const StereoRig& rig, const LoopOptions& options);

}  // namespace fbvins::app
