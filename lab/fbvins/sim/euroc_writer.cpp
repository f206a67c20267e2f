// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/euroc_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "fbvins/core/atomic_file.hpp"

namespace fbvins {
namespace {

std::string landmarks_csv(const Simulation& s) {
  std::string text = "#p_x [m], p_y [m], p_z [m]\n";
  for (const Facet& f : s.world->facets)
    for (const Vec3& corner : {f.corner, Vec3(f.corner + f.u), Vec3(f.corner + f.u + f.v), Vec3(f.corner + f.v)}) {
      const Vec3 p = corner - s.world_from_flight;
      text += fmt::format("{:.5f},{:.5f},{:.5f}\n", p.x(), p.y(), p.z());
    }
  return text;
}

}  // namespace

Result<EurocFolder> create_simulated_recording(const std::string& folder, const StereoRig& rig, bool depth) {
  // EuRoC's own calibration has no time offset: a reader has to estimate it.
  StereoRig without_offset = rig;
  without_offset.time_offset_s = 0;
  return EurocFolder::create(folder, without_offset, "simulated by fbvins", depth);
}

Result<void> finish_recording(EurocFolder& recording, const SimulatedImu& imu) {
  std::vector<TrajectoryPoint> truth;
  truth.reserve(imu.truth.size());
  for (const TrueState& s : imu.truth) truth.push_back({s.t, s.T_WB, s.v_WB, s.bias});
  return recording.finish(imu.samples, truth);
}

Result<void> write_euroc(Simulation& simulation, const std::string& folder, const EurocWriterOptions& options,
                         const std::function<void(int done, int all)>& progress) {
  Result<EurocFolder> recording = create_simulated_recording(folder, simulation.calibrated, options.depth);
  if (!recording) return recording.error();
  if (options.landmarks) {
    const std::string path = (std::filesystem::path(folder) / "mav0/landmarks.csv").string();
    if (Result<void> done = write_file_atomically(path, landmarks_csv(simulation)); !done) return done;
  }
  int count = static_cast<int>(simulation.frames.size());
  if (options.max_frames > 0) count = std::min(count, options.max_frames);
  for (int i = 0; i < count; ++i) {
    RenderedFrame rendered = render_frame(simulation, static_cast<std::size_t>(i), options.depth);
    if (Result<void> done = recording->add(std::move(rendered.frame), rendered.right_stamp, std::move(rendered.depth_left_m));
        !done)
      return done;
    if (progress) progress(i + 1, count);
  }
  if (Result<void> done = recording->add_aiding(simulation.aiding); !done) return done;
  return finish_recording(*recording, simulation.imu);
}

}  // namespace fbvins
