// SPDX-License-Identifier: Apache-2.0
// Private to io: a rangefinder's folder in a recording of EuRoC's layout, range0: sensor.yaml says where the beam begins and
// points (the x axis of T_BS, as that of sensor_msgs/Range), data.csv holds stamps and distances. Pure functions.
//
//   Result<std::vector<RangeSample>> readings = parse_ranges(sensor_yaml, csv, "range0/data.csv", T_BI, warnings);
#pragma once

#include <string>
#include <vector>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/io/yaml_reader.hpp"
#include "fbvins/types/range.hpp"

namespace fbvins {

inline constexpr const char* kRangeFolder = "range0/";

/// Stamps are as in the file. `T_BI`: takes IMU to the recording's body coordinates. Rows that are left out are said in `warnings`.
Result<std::vector<RangeSample>> parse_ranges(YamlReader sensor, const std::string& csv, const std::string& file,
                                              const Pose<B, B>& T_BI, std::vector<std::string>& warnings);

/// Both files, of readings of one beam.
std::string range_yaml(const RangeSample& beam, const std::string& origin);
std::string range_csv(const std::vector<RangeSample>& readings);

}  // namespace fbvins
