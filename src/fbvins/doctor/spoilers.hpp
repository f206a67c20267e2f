// SPDX-License-Identifier: Apache-2.0
// Wrong setups, made of good recordings: what users do to a rig, a driver or a calibration. For tests and for the tables of
// docs/doctor.md. Pure values; a spoiler's `frame` keeps state, so that each recording takes a fresh one from spoilers().
//
//   for (const Spoiler& spoiler : spoilers(rig)) {
//     StereoRig wrong = spoiler.spoilt(rig);
//     spoiler.reading(sample); spoiler.frame(frame);      // where set
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
  FindingKind kind;      ///< what the doctor should say
  double size = 0;       ///< and how large, in that finding's unit; 0 where it is not asked
  double tolerance = 0;  ///< the size may be off by this
  std::function<void(StereoRig&)> rig = {};
  std::function<void(ImuSample&)> reading = {};
  std::function<void(StereoFrame&)> frame = {};
};

/// `rig` as calibrated.
std::vector<Spoiler> spoilers(const StereoRig& rig);

}  // namespace fbvins
