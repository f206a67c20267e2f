// SPDX-License-Identifier: Apache-2.0
// The doctor on a recording that can be played again. Where something is very wrong, the calibration as given is compared with
// those that common mistakes make of a right one (an inverse transform, images upside down or mirrored, lenses of another image
// size, exchanged cameras): each is examined as a whole, and what leaves the fewest figures open is told. Pure functions.
//
//   const Replay replay = [&](const TakeEvent& take) -> Result<void> { return recording.play(take); };
//   Result<Diagnosis> diagnosis = diagnose(rig, replay, CalibrationStyle::euroc);
#pragma once

#include <functional>
#include <optional>
#include <span>

#include "fbvins/core/result.hpp"
#include "fbvins/doctor/doctor.hpp"
#include "fbvins/io/dataset_info.hpp"
#include "fbvins/types/sensor_event.hpp"

namespace fbvins {

/// False once enough has been seen.
using TakeEvent = std::function<bool(SensorEvent)>;
/// Plays the recording from its start.
using Replay = std::function<Result<void>(const TakeEvent&)>;

/// Of a rig of more than two cameras each pair is judged, in the order of their first cameras.
Result<Diagnosis> diagnose(const StereoRig& rig, const Replay& replay, CalibrationStyle style);

/// Of lenses that were scaled to the images (DatasetOptions::scale_lenses), with which `found` was found: one more finding, which
/// they correct. With none of them nothing changes.
void tell_of_scaled(std::span<const ScaledLens> scaled, CalibrationStyle style, Diagnosis& found, bool squeezed = false);

/// The rig with lenses of images that were squeezed to another shape, instead of those of the calibrated images' middle; none
/// where no image has another shape.
std::optional<StereoRig> squeezed_rig(const StereoRig& rig, std::span<const ScaledLens> scaled);
/// Whether `squeezed` explains the recording better than `cropped`.
bool is_squeezed(const Diagnosis& squeezed, const Diagnosis& cropped);

/// The calibration as given, not compared with common mistakes.
Result<Diagnosis> examine_with(const StereoRig& rig, const Replay& replay, CalibrationStyle style);

}  // namespace fbvins
