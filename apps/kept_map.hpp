// SPDX-License-Identifier: Apache-2.0
// The map of a live flight, written periodically during the flight, so that a killed program leaves a map.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "apps/file_writer.hpp"
#include "apps/run_map.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/types/mapper.hpp"

namespace fbvins::app {

/// Runs on the thread of loop closure, where it takes the map's bytes; a thread of its own writes them. While a slow disk has not
/// finished one file no other is begun: the next one is of the newest map. Warns once of a file that cannot be written.
class KeptMap final : public Mapper {
 public:
  using Told = FileWriter::Told;

  /// `file` empty: the map is written only on request. `map` must outlive this; `bytes` are those of its file.
  KeptMap(Mapper& map, std::function<std::string()> bytes, std::string file, WriteFile write = write_file_atomically);
  MapUpdate process(const Keyframe& keyframe) override;

  /// Waits until the file being written is complete. The receiver of on_request() may be destroyed afterwards.
  void finish() const { writer_.wait(); }
  /// The map is written after the next keyframe. From any thread.
  void request_save() { wanted_ = true; }
  /// To be called before the first keyframe: the file for requested maps, and who is told the result, on the writer's thread.
  void on_request(std::string file, Told told) { requested_file_ = std::move(file), told_ = std::move(told); }

 private:
  bool due(Time t);

  Mapper& map_;
  std::function<std::string()> bytes_;
  std::string file_, requested_file_;
  Told told_;
  Time written_;         ///< keyframe's time
  bool warned_ = false;  ///< on the writer's thread
  std::atomic<bool> wanted_{false};
  FileWriter writer_;  ///< last: its thread uses the members above
};

/// The map of `--map FILE`: continued if the file exists. An unusable file is set aside, said, and a new map begun; where that is
/// not possible either the flight keeps no map, and `arguments.save` becomes empty. Errors: those of the installation, as in
/// make_map.
Result<std::unique_ptr<LoopMap>> make_kept_map(MapArguments& arguments, const StereoRig& rig, const LoopOptions& options);

}  // namespace fbvins::app
