// SPDX-License-Identifier: Apache-2.0
// Private to io: fields of a YAML file, checked, with file and line in the first complaint.
//
//   YamlReader yaml("cam0/sensor.yaml", text);
//   double rate = yaml.number(yaml.root()["rate_hz"], "rate_hz");
//   if (!yaml.ok()) return yaml.error();
//
// After a complaint every getter still returns a harmless value, so that reading code has no branches.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

#include "fbvins/core/result.hpp"

namespace fbvins {

class YamlReader {
 public:
  /// OpenCV's header line `%YAML:1.0`, which is not YAML, is accepted.
  YamlReader(std::string file, std::string text);

  bool ok() const { return error_.message.empty(); }
  const Error& error() const { return error_; }

  /// The member of a map; an undefined node if it or the map is not there.
  YAML::Node get(const YAML::Node& map, const std::string& field) const;
  const YAML::Node& root() const { return root_; }
  bool has(const YAML::Node& map, const std::string& field) const { return get(map, field).IsDefined(); }

  double number(const YAML::Node& map, const std::string& field);
  double positive(const YAML::Node& map, const std::string& field);
  std::string word(const YAML::Node& map, const std::string& field);
  /// A list of exactly `count` numbers; lists inside of lists are joined.
  std::vector<double> numbers(const YAML::Node& map, const std::string& field, std::size_t count);
  /// Same, of any length.
  std::vector<double> numbers(const YAML::Node& map, const std::string& field);

  /// "file:line: field: sentence" (line of the field where it is there). Only the first one counts.
  void complain(const YAML::Node& map, const std::string& field, const std::string& sentence);

 private:
  void flatten(const YAML::Node& node, const YAML::Node& map, const std::string& field, int depth, std::vector<double>& out);

  std::string file_;
  YAML::Node root_;
  Error error_{ErrorCode::malformed, ""};
};

}  // namespace fbvins
