// SPDX-License-Identifier: Apache-2.0
// Private to io: folders of aiding sensors in a recording of EuRoC's layout: range0, velocity0, baro0 and further ones of each
// kind. sensor.yaml says where the sensor sits and how good it is, data.csv holds stamps and numbers. Pure functions.
//
//   for (const AidingFolder& kind : aiding_folders())
//     Result<std::vector<AidingSample>> readings = kind.parse({sensor_yaml, csv, "range0/data.csv", T_BI}, warnings);
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/io/yaml_reader.hpp"
#include "fbvins/types/aiding.hpp"

namespace fbvins {

/// Stamps are as in the file. `T_BI`: takes IMU to the recording's body coordinates.
struct AidingFiles {
  YamlReader sensor;
  std::string csv;
  std::string file;  ///< that the numbers are in, for messages
  Pose<B, B> T_BI = {};
};

struct AidingFolder {
  std::string_view name;  ///< with a number behind it
  /// Rows that are left out are said in `warnings`.
  Result<std::vector<AidingSample>> (*parse)(AidingFiles files, std::vector<std::string>& warnings);
};
/// One of each kind.
std::span<const AidingFolder> aiding_folders();
/// Sensors of one kind that a recording may have.
inline constexpr int kMostAiding = 8;

struct AidingText {
  std::string folder;  ///< "range0"
  std::string sensor_yaml, csv;
};
/// A folder for each sensor.
std::vector<AidingText> aiding_texts(const std::vector<AidingSample>& readings, const std::string& origin);

}  // namespace fbvins
