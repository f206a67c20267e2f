// SPDX-License-Identifier: Apache-2.0
#include "apps/calibrate_imu_noise.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "apps/commands.hpp"
#include "apps/open_cameras.hpp"
#include "apps/terminal.hpp"
#include "fbvins/calibration/imu_noise.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/io/imu_file.hpp"

namespace fbvins::app {

int measure_imu_noise(const ImuNoiseArguments& a) {
  std::vector<ImuSample> readings;
  if (std::filesystem::path(a.recording).extension() == ".csv") {
    Result<std::vector<ImuSample>> read = read_imu_csv(a.recording);
    if (!read) return fail(read.error().message);
    readings = *std::move(read);
  } else {
    Result<CameraRecording> recording = open_cameras(a.recording, a.topics);
    if (!recording) return fail(recording.error().message);
    readings = std::move(recording->imu);
  }
  const Result<ImuNoiseResult> found = measure_imu_noise(readings);
  if (!found) {
    fail(found.error().message);
    return kEstimationFailed;
  }
  const std::string text = imu_noise_to_kalibr(*found, "/imu0");
  if (Result<void> done = write_files(a.out, {{"imu.yaml", text}}); !done) return fail(done.error().message);
  if (a.quiet) return kOk;
  fmt::print("{:.1f} s at rest\n{}", found->duration_s, text);
  for (const std::string& warning : found->warnings) fmt::print("note: {}\n", warning);
  fmt::print("written to {}\n", bold(a.out + "/imu.yaml"));
  return kOk;
}

}  // namespace fbvins::app
