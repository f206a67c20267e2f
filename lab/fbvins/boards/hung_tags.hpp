// SPDX-License-Identifier: Apache-2.0
// AprilTags on the walls of a simulated place, where the flight's left camera sees them best. Pure functions.
//
//   TagSurvey survey;
//   Result<Simulation> simulation = prepare_simulation(options, [&](World& world, const Simulation& s) {
//     survey = *hang_tags(world, s, 3, 0.2);
//   });
#pragma once

#include "fbvins/calibration/tag_survey.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {

/// Tags 0, 1, ..., upright and at least two metres apart. Their poses are in the frame of the recording's truth. An error where
/// fewer places are seen, or where this build knows no tags.
Result<TagSurvey> hang_tags(World& world, const Simulation& simulation, int count, double size_m);

}  // namespace fbvins
