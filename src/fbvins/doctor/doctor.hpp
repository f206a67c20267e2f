// SPDX-License-Identifier: Apache-2.0
// Finds out from a recording what is wrong with a setup: units, axes, clocks, extrinsics, lenses, images (docs/doctor.md). Each
// has its own file of pure functions; this one calls them in the order in which each needs the results before it, and leaves
// out what needs a result that is missing. Pure function, any thread.
//
//   EvidenceCollector gatherer(rig);
//   while (auto event = data.next()) if (!gatherer.push(*event)) break;
//   Diagnosis diagnosis = examine(gatherer.finish());
//   fmt::print("{}\n", to_text(diagnosis));
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/checkup/finding.hpp"
#include "fbvins/doctor/accel_fit.hpp"
#include "fbvins/doctor/calibration_lines.hpp"
#include "fbvins/doctor/evidence.hpp"
#include "fbvins/doctor/image_health.hpp"
#include "fbvins/doctor/imu_health.hpp"
#include "fbvins/doctor/motion_fit.hpp"
#include "fbvins/doctor/stereo_fit.hpp"
#include "fbvins/doctor/turn_fit.hpp"

namespace fbvins {

struct Diagnosis {
  std::vector<Finding> findings;
  std::vector<std::string> measured;    ///< one sentence for each measurement, whether right or wrong
  std::vector<std::string> not_judged;  ///< what the recording does not show, and why
  /// What a flight rests on and could not be judged at all, and what to do; empty where it could.
  std::string no_verdict = {};
  StereoRig rig;         ///< the calibration with all findings corrected, of the images in their order
  bool swapped = false;  ///< left and right images are exchanged; `rig` is for them in their order
  /// How well the calibration as it was given explains the recording: typical epipolar error, and error of a feature predicted
  /// from image to image; none where it was not judged.
  std::optional<double> epipolar_px = {}, predicted_px = {};
  /// Of each camera, the mask of what is fixed in view, and of what is masked already; null where nothing more is.
  std::vector<std::shared_ptr<const Mask>> masks;
};

/// The findings, what was not judged, what no recording shows, and in the last line how much was measured; with `all` each
/// measurement. No line end after it.
std::string to_text(const Diagnosis& diagnosis, bool all = false);

Diagnosis examine(const Evidence& evidence, CalibrationStyle style = CalibrationStyle::euroc);

}  // namespace fbvins
