// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/refine_corrected.hpp"

#include <vector>

#include "fbvins/calibration/flight_calibration.hpp"
#include "fbvins/pipeline/system.hpp"

namespace fbvins {
namespace {

/// Of the recording at most, which bounds the work.
constexpr double kLongest_s = 60;

std::optional<FlightGroup> group_of(FindingKind kind) {
  switch (kind) {
    case FindingKind::imu_camera_rotation: return FlightGroup::mounting;
    case FindingKind::imu_camera_position: return FlightGroup::lever;
    case FindingKind::time_offset: return FlightGroup::time_offset;
    case FindingKind::right_camera_turned: return FlightGroup::between_cameras;
    case FindingKind::baseline_direction:
    case FindingKind::baseline_length: return FlightGroup::baseline;
    case FindingKind::focal_length: return FlightGroup::focal;
    case FindingKind::principal_point: return FlightGroup::centre;
    case FindingKind::distortion: return FlightGroup::distortion;
    default: return std::nullopt;
  }
}

std::vector<FlightGroup> rough_groups(std::span<const Finding> findings) {
  std::vector<FlightGroup> out;
  for (const Finding& finding : findings)
    if (const auto group = group_of(finding.kind); group && std::ranges::find(out, *group) == out.end()) out.push_back(*group);
  return out;
}

/// None where it cannot be flown.
Result<std::optional<FlightTracks>> fly(const StereoRig& rig, const Replay& replay) {
  const std::optional<FlightTracks> none;
  SystemOptions options;
  options.frontend.kind = "klt";
  Result<System> system = System::create(options, rig);
  if (!system) return none;
  FlightCollector collector;
  system->on_tracked_frame([&](const TrackedFrame& f) { collector.add(f); });
  system->on_keyframe([&](const Keyframe& k) { collector.add(k); });
  std::optional<Time> first;
  const Result<void> played = replay([&](SensorEvent event) {
    if (const auto* frame = std::get_if<StereoFrame>(&event)) {
      if (!first) first = frame->t;
      if ((frame->t - *first).seconds() > kLongest_s) return false;
    }
    return system->push(std::move(event)).ok();
  });
  if (!played) return played.error();
  if (!system->finish()) return none;
  return std::optional(collector.take());
}

}  // namespace

Result<std::optional<StereoRig>> refined_by_flight(const StereoRig& corrected, std::span<const Finding> findings,
                                                   const Replay& replay) {
  const std::optional<StereoRig> none;
  FlightCalibrationOptions options;
  options.rough = rough_groups(findings);
  if (options.rough.empty()) return none;
  const Result<std::optional<FlightTracks>> tracks = fly(corrected, replay);
  if (!tracks) return tracks.error();
  if (!*tracks) return none;
  const Result<FlightCalibration> found = calibrate_from_flights({**tracks}, {"the recording"}, corrected, options);
  return found && found->better ? std::optional(found->rig) : none;
}

}  // namespace fbvins
