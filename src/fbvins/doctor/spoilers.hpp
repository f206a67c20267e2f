// SPDX-License-Identifier: Apache-2.0
// Injects faults into good recordings: mistakes made with a rig, a driver or a calibration. For tests and the tables of
// docs/doctor.md. A spoiler is one such fault. Its functions may keep state: take a fresh one from spoilers() for each recording.
//
//   for (const Spoiler& spoiler : spoilers(rig)) {
//     spoiler.rig(wrong_rig);
//     if (!spoiler.lost(sample)) spoiler.reading(sample);
//     spoiler.frame(frame);                               // each where it is set
//   }
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/checkup/finding.hpp"
#include "fbvins/types/sensor_event.hpp"

namespace fbvins {

struct Spoiler {
  std::string name;
  FindingKind kind = FindingKind::gyro_units;  ///< what the doctor should find
  double size = 0;                             ///< and how large, in that finding's unit; 0: not checked
  double tolerance = 0;                        ///< largest difference from `size`
  std::function<void(StereoRig&)> rig = {};
  std::function<void(ImuSample&)> reading = {};
  std::function<void(StereoFrame&)> frame = {};
  std::function<bool(const ImuSample&)> lost = {};  ///< asked before `reading`; a lost one is not delivered
};

/// All faults, for a recording with this rig.
std::vector<Spoiler> spoilers(const StereoRig& rig);

}  // namespace fbvins
