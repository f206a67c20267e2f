// SPDX-License-Identifier: Apache-2.0
// The results of a run: gathered frame by frame (RunRecord) or written as they come (RunWriter).
// trajectory_tum.txt, trajectory.csv, statistics.csv and config.yaml are the same bytes for the same
// input and configuration; times go to timing.csv and to their own part of the summary.
// Frames and odometry may come from two threads: either side touches only its own vector.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/frontend/survival.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/types/odometry.hpp"
#include "fbvins/types/tracking.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins::app {

struct TrackedRecord {
  FrameId id;
  Time t;
  FrontendStats stats;
  Survival survival;
};

struct RunRecord {
  std::vector<TrackedRecord> tracked;  ///< one per image the frontend saw
  std::vector<Odometry> odometry;      ///< one per image, with or without a pose

  Trajectory<W> poses() const;
  std::vector<Time> images() const;
};

/// The trajectory, statistics and timing files, written as the frames come; the folder must exist. covariance.csv has the
/// covariances that trajectory.csv leaves out: of velocity and biases. Frames come before their odometry, on any thread, which
/// never waits for the disk; odometry and close() on one.
class RunWriter {
 public:
  static Result<RunWriter> create(const std::string& folder);
  RunWriter(RunWriter&&) noexcept;
  RunWriter& operator=(RunWriter&&) noexcept;
  ~RunWriter();

  void add(const TrackedRecord& tracked);
  void add(const Odometry& odometry);
  Result<void> close();

 private:
  struct State;
  explicit RunWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

Result<void> write_run(const RunRecord& record, const std::string& folder);
/// The recording's truth around each image, so that a report needs nothing but this folder.
Result<void> write_truth(const std::vector<Time>& images, const std::vector<TrajectoryPoint>& truth, const std::string& folder);

}  // namespace fbvins::app
