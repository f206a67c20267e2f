// SPDX-License-Identifier: Apache-2.0
// Intervals between images that change with the exposure: in less light a camera takes its images at longer intervals, each of
// which it keeps exactly. Stamps of arrival have any interval. Pure function, any thread.
//
//   if (const auto modes = interval_modes(steps_s)) use(modes->intervals_s, modes->off_s);
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace fbvins {

struct IntervalModes {
  std::vector<double> intervals_s;  ///< ascending, two or more
  double off_s = 0;                 ///< what the steps that belong to one are off it by, root mean square
  bool holds(double step_s) const;
};

/// From the steps between stamps, in their order; none where one interval explains them, or not nearly all belong to few.
std::optional<IntervalModes> interval_modes(std::span<const double> steps_s);

}  // namespace fbvins
