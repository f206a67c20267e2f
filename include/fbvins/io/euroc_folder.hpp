// SPDX-License-Identifier: Apache-2.0
// Writes a recording as an EuRoC folder, which any VIO program can read. One thread calls.
//
//   Result<EurocFolder> recording = EurocFolder::create("out/flight", rig, "recorded by hand");
//   recording->add(frame, frame.t);                          // images are written while the next ones are made
//   Result<void> done = recording->finish(readings, truth);
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/types/aiding.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

class EurocFolder {
 public:
  /// Makes folder/mav0/{cam0, ... for each camera, depth0 for a depth sensor, imu0, state_groundtruth_estimate0} with the
  /// calibrations; the folder must not hold a mav0. `origin`: a few words for the sensors' comments, without a colon. `depth`:
  /// frames bring depth images.
  static Result<EurocFolder> create(const std::string& folder, const StereoRig& rig, const std::string& origin,
                                    bool depth = false);
  ~EurocFolder();
  EurocFolder(EurocFolder&&) noexcept;
  EurocFolder& operator=(EurocFolder&&) noexcept;

  /// A camera without an image has no row. Cameras but the right one have the frame's stamp. `depth_left_m`: row by row, 0 where
  /// nothing is; written as 16-bit PNG in millimetres to depth0.
  Result<void> add(StereoFrame frame, Time right_stamp, std::vector<float> depth_left_m = {});
  /// Of aiding sensors, each to a folder of its own: range0, velocity0, baro0. To be called once at most.
  Result<void> add_aiding(const std::vector<AidingSample>& readings);
  /// Writes readings and truth (zeros where it has no velocity or biases), and completes the recording. To be called once.
  Result<void> finish(const std::vector<ImuSample>& readings, const std::vector<TrajectoryPoint>& truth);

 private:
  struct State;
  explicit EurocFolder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace fbvins
