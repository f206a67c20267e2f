// SPDX-License-Identifier: Apache-2.0
// A flight from hover to hover, axis by axis, as in the paper's Tables 2 and 3: where it began and ended by the truth and by the
// estimate, and the displacement that was intended. Pure functions, any thread.
#pragma once

#include <optional>

#include "fbvins/core/result.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins {

/// A time span over which positions are averaged.
struct HoverSpan {
  Time from, to;
};

/// Positions of B in W, m.
struct AxisErrors {
  HoverSpan start, end;
  Vec3 truth_start = Vec3::Zero(), truth_end = Vec3::Zero();
  Vec3 estimate_start = Vec3::Zero(), estimate_end = Vec3::Zero();
  Vec3 expected = Vec3::Zero();  ///< intended displacement; where none is given, the estimate's
  Vec3 truth_difference() const { return truth_end - truth_start; }
  Vec3 estimate_difference() const { return estimate_end - estimate_start; }
  /// How far the flight missed its target.
  Vec3 axial_error() const { return truth_difference() - expected; }
};

/// The first and the last span of a second or more in which the truth moves slower than 0.1 m/s; nullopt where there are not two.
struct HoverPair {
  HoverSpan first, last;
};
std::optional<HoverPair> find_hovers(const Trajectory<W>& truth);

/// An error where a span holds poses of only one of the two.
Result<AxisErrors> axis_errors(const Trajectory<W>& truth, const Trajectory<W>& estimate, const HoverSpan& start,
                               const HoverSpan& end, const std::optional<Vec3>& expected = std::nullopt);

}  // namespace fbvins
