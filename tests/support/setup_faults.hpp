// SPDX-License-Identifier: Apache-2.0
// Injects faults into good recordings: mistakes made with a rig, a driver or a calibration. For tests and the tables of
// docs/doctor.md. The functions of a fault may keep state: take a fresh one from setup_faults() for each recording.
//
//   for (const SetupFault& fault : setup_faults(rig)) {
//     fault.rig(wrong_rig);
//     if (!fault.lost(sample)) fault.reading(sample);
//     fault.frame(frame);                               // each where it is set
//   }
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/checkup/finding.hpp"
#include "fbvins/types/sensor_event.hpp"

namespace fbvins {

struct SetupFault {
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
std::vector<SetupFault> setup_faults(const StereoRig& rig);

}  // namespace fbvins
