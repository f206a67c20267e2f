// SPDX-License-Identifier: Apache-2.0
#include "apps/calibrate_from_flight.hpp"

#include <fmt/format.h>

#include "apps/commands.hpp"
#include "apps/flight_calibration_report.hpp"
#include "apps/open_recording.hpp"
#include "apps/progress.hpp"
#include "apps/terminal.hpp"
#include "fbvins/calibration/flight_tracks.hpp"
#include "fbvins/config/config.hpp"
#include "fbvins/pipeline/system.hpp"

namespace fbvins::app {
namespace {

struct Flown {
  StereoRig rig;
  FlightTracks tracks;
};

/// The recording through the odometry, as `fbvins run --frontend klt` flies it.
Result<Flown> fly(const std::string& path, const FromFlightArguments& a) {
  RecordingArguments recording;
  recording.path = path, recording.calibration = a.calibration, recording.imu_calibration = a.imu_calibration;
  recording.topics = a.topics;
  const Result<std::unique_ptr<Dataset>> data = open_recording(recording, {});
  if (!data) return data.error();
  RecordingWarnings warnings;
  warnings.print((*data)->info());
  Config config;
  config.frontend.kind = "klt";
  config.estimator.align_time_offset = false;  // it is found by all pieces together, which have the given one
  Result<System> system = System::create(config, (*data)->rig(), RunMode::threaded);
  if (!system) return Error{system.error().code, fmt::format("{}: {}", path, system.error().message)};
  FlightCollector collector;
  system->on_tracked_frame([&](const TrackedFrame& f) { collector.add(f); });
  system->on_keyframe([&](const Keyframe& k) { collector.add(k); });
  Progress progress(static_cast<int>((*data)->frames().size()), a.quiet);
  int frames = 0;
  while (auto event = (*data)->next()) {
    const bool is_frame = std::holds_alternative<StereoFrame>(*event);
    if (Result<void> taken = system->push(std::move(*event)); !taken) return taken.error();
    if (is_frame) progress.update(++frames);
  }
  if (Result<void> done = system->finish(); !done) return done.error();
  warnings.print_at_end((*data)->info());
  return Flown{(*data)->rig(), collector.take()};
}

bool same_calibration(const StereoRig& a, const StereoRig& b) {
  if (a.camera_count() != b.camera_count()) return false;
  for (int k = 0; k < a.camera_count(); ++k)
    if (a.camera(k).model_name() != b.camera(k).model_name()) return false;
  return a.imu_noise.axes == b.imu_noise.axes && values(flight_rig(a)).isApprox(values(flight_rig(b)), 1e-9);
}

}  // namespace

int calibrate_from_flight(const FromFlightArguments& a) {
  std::vector<FlightTracks> flights;
  std::optional<StereoRig> rig;
  for (const std::string& run : a.runs) {
    if (!a.quiet) note(run);
    Result<Flown> flown = fly(run, a);
    if (!flown) return fail(flown.error().message);
    if (rig && !same_calibration(*rig, flown->rig))
      return fail(fmt::format("{}: has another calibration than {}: --calibration gives one for all", run, a.runs.front()));
    rig = flown->rig;
    flights.push_back(std::move(flown->tracks));
  }
  FlightCalibrationOptions options;
  if (!a.quiet) options.on_progress = [](const std::string& what) { note(what); };
  const Result<FlightCalibration> found = calibrate_from_flights(flights, a.runs, *rig, options);
  if (!found) {
    fail(found.error().message);
    return kEstimationFailed;
  }
  if (Result<void> done = write_flight_calibration(*found, a.runs, a.out); !done) return fail(done.error().message);
  if (!a.quiet) fmt::print("{}results in {}\n", flight_calibration_text(*found), bold(a.out));
  return kOk;
}

}  // namespace fbvins::app
