// SPDX-License-Identifier: Apache-2.0
// For tests: a simulated recording in memory, which several flights use.
//
//   static const RenderedRecording recording = rendered(options);
#pragma once

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "fbvins/io/dataset.hpp"
#include "fbvins/sim/simulation.hpp"
#include "fbvins/types/sensor_event.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins::test {

struct RenderedRecording {
  StereoRig rig;
  std::vector<SensorEvent> events;
  Trajectory<W> truth;
};

inline RenderedRecording rendered(const SimulationOptions& options) {
  Result<DatasetContents> contents = simulate(options);
  EXPECT_TRUE(contents.ok());
  RenderedRecording out;
  for (const TrajectoryPoint& p : contents->ground_truth) out.truth.push_back({p.t, p.T_WB});
  Dataset data(*std::move(contents), {});
  out.rig = data.rig();
  while (auto event = data.next()) out.events.push_back(*std::move(event));
  return out;
}

}  // namespace fbvins::test
