// SPDX-License-Identifier: Apache-2.0
// Private: how a trajectory file is written, found from its first rows: separator, unit of the stamps, order of the quaternion,
// what lies behind the pose. Pure functions, any thread.
//
//   const Result<TrajectoryLayout> layout = recognise(data, header, file, wanted);
//   layout->recognised   // "stamps in microseconds, ..." for people; empty for plain TUM and EuRoC files
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/io/csv.hpp"
#include "fbvins/io/trajectory.hpp"

namespace fbvins {

struct TrajectoryLayout {
  char separator = ' ';           ///< ' ': runs of blanks and tabs
  std::size_t stamp = 0;          ///< column; 1 behind a running number
  std::size_t columns = 8;        ///< without empty ones at the end
  double unit_ns = 1e9;           ///< of the stamps
  bool w_first = false;           ///< quaternion's order
  bool velocity = false;          ///< three columns behind the pose, in W
  bool state = false;             ///< EuRoC's: velocity and two biases
  bool quaternion_first = false;  ///< before the position: OpenVINS' state_est.txt
  bool angles = false;            ///< roll, pitch and yaw instead of a quaternion
  double angle_rad = 1;           ///< their unit
  std::string recognised;
};

/// `data`: rows without comments and header. `header`: the first line, whatever it is.
Result<TrajectoryLayout> recognise(const std::vector<CsvLine>& data, std::string_view header, const std::string& file,
                                   const TrajectoryFormat& wanted);

/// The columns of a row; empty ones at its end, which a separator there makes, are left out.
void split_row(const TrajectoryLayout& layout, std::string_view line, std::vector<std::string_view>& fields);

/// A stamp in the layout's unit, digit by digit.
std::optional<Time> parse_stamp(const TrajectoryLayout& layout, std::string_view text);

}  // namespace fbvins
