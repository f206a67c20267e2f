// SPDX-License-Identifier: Apache-2.0
// Corrected lines of a calibration file, in EuRoC's or Kalibr's format. Pure functions.
#pragma once

#include <span>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/checkup/finding.hpp"

namespace fbvins {

enum class CalibrationStyle { euroc, kalibr };

/// A field as `rig` has it. A mask's is that of the picture which the doctor writes.
std::string line_of(CalibrationField field, const StereoRig& rig, CalibrationStyle style);

/// Gives the findings the lines of `rig`, in which all of them are corrected. Each field has one line, at its first finding.
void write_lines(std::span<Finding> findings, const StereoRig& rig, CalibrationStyle style);

}  // namespace fbvins
