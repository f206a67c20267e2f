// SPDX-License-Identifier: Apache-2.0
// Output of a tuning: a text, gains for `fbvins fly --control` and for QGroundControl, and a plot of every loop's step response
// before and after. The same tuning gives the same bytes. Pure functions.
#pragma once

#include <string>

#include "fbvins/tuning/gain_design.hpp"

namespace fbvins {

std::string tuning_text(const Tuning& tuning, const TuneOptions& options);
std::string control_yaml(const ControlOptions& control);
/// QGroundControl's parameter file with the changed gains.
std::string px4_parameter_file(const Tuning& tuning);
std::string tuning_svg(const Tuning& tuning);

}  // namespace fbvins
