// SPDX-License-Identifier: Apache-2.0
// Writes a simulation as a EuRoC folder that any VIO program can read. One thread calls.
//
//   Result<void> done = write_euroc(simulation, "out/flight", {}, [](int done, int all) { ... });
#pragma once

#include <functional>
#include <memory>
#include <string>

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

/// The same, frame by frame as a flight goes on; images are written while the next one is rendered.
///
///   Result<EurocFolder> recording = EurocFolder::create("out/flight", rig);
///   recording->add(rendered);
///   Result<void> done = recording->finish(imu);
class EurocFolder {
 public:
  /// The folder is made, and must not hold a mav0. `depth`: frames bring depth images.
  static Result<EurocFolder> create(const std::string& folder, const StereoRig& rig, bool depth = false);
  ~EurocFolder();
  EurocFolder(EurocFolder&&) noexcept;
  EurocFolder& operator=(EurocFolder&&) noexcept;

  Result<void> add(RenderedFrame rendered);
  /// Writes readings and truth, and completes the recording. To be called once.
  Result<void> finish(const SimulatedImu& imu);

 private:
  struct State;
  explicit EurocFolder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Fast PNG, with one filter and the lowest compression: 8-bit or 16-bit grey.
std::string encode_png(const Image& image);
std::string encode_png16(const std::vector<std::uint16_t>& values, int width, int height);

}  // namespace fbvins
