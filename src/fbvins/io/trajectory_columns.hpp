// SPDX-License-Identifier: Apache-2.0
// Private: trajectories whose header says which column is what, decimal commas, positions alone: written again as rows that
// parse_trajectory() knows. Pure functions, any thread.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "fbvins/core/result.hpp"

namespace fbvins {

struct RewrittenRows {
  std::string text;                            ///< each row in the line that it had
  std::string said;                            ///< what was found, for people
  std::optional<bool> w_first = std::nullopt;  ///< the order of quaternions that were written anew
};

/// With points where numbers have decimal commas, between semicolons or blanks; none of other files.
std::optional<RewrittenRows> with_decimal_points(std::string_view text);

/// The columns that the header names (`rostopic echo -p`, ulog2csv and others) as stamp, position, and quaternion w x y z; none
/// where it names none, or they are where they are read anyway. Without a quaternion with that of no rotation.
std::optional<RewrittenRows> by_column_names(std::string_view text);

/// Stamps and positions, four columns: with the quaternion of no rotation; none of other files.
std::optional<RewrittenRows> with_no_orientation(std::string_view text);

}  // namespace fbvins
