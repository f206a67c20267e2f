// SPDX-License-Identifier: Apache-2.0
// What is wrong with a setup, by a recording of it: units, axes, clocks, mounting, lenses, images (docs/doctor.md). One module of
// pure functions each; this one asks them in the order in which an answer rests on those before, and leaves out what rests
// on something that is broken. Pure function, any thread.
//
//   EvidenceGatherer gatherer(rig);
//   while (auto event = data.next()) if (!gatherer.push(*event)) break;
//   Diagnosis diagnosis = examine(gatherer.finish());
//   for (const Finding& finding : diagnosis.findings) fmt::print("{}\n", to_text(finding));
#pragma once

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
  std::vector<std::string> measured;    ///< one sentence each, whether right or wrong
  std::vector<std::string> not_judged;  ///< what the recording does not show, and why
  StereoRig rig;                        ///< with all that was found corrected
};

Diagnosis examine(const Evidence& evidence, CalibrationStyle style = CalibrationStyle::euroc);

}  // namespace fbvins
