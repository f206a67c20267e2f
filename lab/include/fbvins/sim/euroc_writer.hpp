// SPDX-License-Identifier: Apache-2.0
// Writes a simulation as a EuRoC folder that any VIO program can read. One thread calls.
//
//   Result<void> done = write_euroc(simulation, "out/flight", {}, [](int done, int all) { ... });
#pragma once

#include <functional>
#include <string>

#include "fbvins/io/euroc_folder.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {

struct EurocWriterOptions {
  bool depth = false;      ///< left depth images, 16-bit PNG in millimetres, as mav0/depth0
  bool landmarks = false;  ///< corners of the world's facets, as mav0/landmarks.csv
  int max_frames = 0;      ///< 0: all
};

/// Folder/mav0/{cam0,cam1,imu0,state_groundtruth_estimate0}; the folder is made, and must not hold a mav0.
Result<void> write_euroc(Simulation& simulation, const std::string& folder, const EurocWriterOptions& options,
                         const std::function<void(int done, int all)>& progress);

/// For a flight that is recorded as it goes on: the folder that write_euroc() makes, and its end with readings and truth.
Result<EurocFolder> create_simulated_recording(const std::string& folder, const StereoRig& rig, bool depth = false);
Result<void> finish_recording(EurocFolder& recording, const SimulatedImu& imu);

}  // namespace fbvins
