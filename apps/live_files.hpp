// SPDX-License-Identifier: Apache-2.0
// What `fbvins live --out` writes while it runs: the files of `fbvins run`, and poses at IMU rate. It uses constant memory.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "apps/run_output.hpp"
#include "fbvins/frontend/survival.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/live/sink.hpp"

namespace fbvins::app {

/// trajectory_tum.txt, trajectory.csv, covariance.csv, gauge.csv, statistics.csv, timing.csv; live_tum.txt (W, IMU rate);
/// with loop closure map_causal_tum.txt and map_bounded_tum.txt (poses in M: with the correction known at each image, and with
/// the smoothed one).
class LiveFiles final : public Sink {
 public:
  static Result<std::unique_ptr<LiveFiles>> create(const std::string& folder, bool with_map, bool new_map);

  std::string_view name() const override { return "files"; }
  Result<void> take(const LiveEvent& event) override;
  Result<void> finish() override;

  /// On the frontend's thread.
  void add(const TrackedFrame& frame);

 private:
  struct MapFiles {
    TumWriter causal, bounded;
    std::optional<MapUpdate> newest;
    std::optional<std::uint32_t> first_reset;  ///< reset counter of the first image
  };
  LiveFiles(RunWriter run, TumWriter live) : run_(std::move(run)), live_(std::move(live)) {}
  void take_map(const Odometry& o);

  RunWriter run_;
  TumWriter live_;
  std::optional<MapFiles> map_;
  bool new_map_ = true;
  SurvivalMeter survival_;
};

}  // namespace fbvins::app
