// SPDX-License-Identifier: Apache-2.0
// A tuning for people and programs: tables, gains as `fbvins fly --control` and as QGroundControl read them, and a picture of
// every loop's step before and after. The same tuning gives the same bytes. Pure functions.
#pragma once

#include <string>

#include "fbvins/tuning/gain_design.hpp"

namespace fbvins {

std::string tuning_text(const Tuning& tuning, const TuneOptions& options);
std::string control_yaml(const ControlOptions& control);
/// QGroundControl's parameter file, with those that changed.
std::string px4_parameter_file(const Tuning& tuning);
std::string tuning_svg(const Tuning& tuning);

}  // namespace fbvins
