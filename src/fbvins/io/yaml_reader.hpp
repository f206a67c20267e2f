// SPDX-License-Identifier: Apache-2.0
// The one reader of YAML: fields checked, with file and line in the first complaint. Calibrations, configurations and
// experiment matrices are read with it. Private: it shows yaml-cpp. One thread.
//
//   YamlReader yaml("cam0/sensor.yaml", text);
//   double rate_hz = yaml.positive(yaml.root(), "rate_hz");
//   if (!yaml.ok()) return yaml.error();
//
// A field that is there twice is a complaint. After a complaint every getter still returns a harmless value, so that reading code
// has no branches.
#pragma once

#include <yaml-cpp/yaml.h>

#include <initializer_list>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"

namespace fbvins {

class YamlReader {
 public:
  enum class Root {
    fields,   ///< complain unless the file is a map
    anything  ///< the caller checks
  };
  /// OpenCV's header line `%YAML:1.0`, which is not YAML, is accepted.
  YamlReader(std::string file, std::string text, Root root = Root::fields);

  bool ok() const { return error_.message.empty(); }
  const std::string& file() const { return file_; }
  const Error& error() const { return error_; }

  /// The member of a map; an undefined node if it or the map is not there.
  YAML::Node get(const YAML::Node& map, const std::string& field) const;
  const YAML::Node& root() const { return root_; }
  bool has(const YAML::Node& map, const std::string& field) const { return get(map, field).IsDefined(); }

  // Fields that must be there.
  double number(const YAML::Node& map, const std::string& field);
  double positive(const YAML::Node& map, const std::string& field);
  std::string word(const YAML::Node& map, const std::string& field);
  /// A list of exactly `count` numbers; lists inside of lists are joined.
  std::vector<double> numbers(const YAML::Node& map, const std::string& field, std::size_t count);
  /// Same, of any length.
  std::vector<double> numbers(const YAML::Node& map, const std::string& field);

  // Fields that may be left out.
  double number_between(const YAML::Node& map, const std::string& field, double low, double high, double otherwise);
  std::string text(const YAML::Node& map, const std::string& field);
  /// One value is a list of one.
  std::vector<std::string> texts(const YAML::Node& map, const std::string& field);

  /// Complains about every field of another name.
  void only(const YAML::Node& map, std::initializer_list<const char*> known);

  /// "file:line: field: sentence": the line of the field, or, where it is missing, of the map that lacks it, unless that is all
  /// of the file. Only the first one counts.
  void complain(const YAML::Node& map, const std::string& field, const std::string& sentence);
  /// "file:line: sentence".
  void complain(const YAML::Mark& mark, const std::string& sentence);
  void complain(const YAML::Node& node, const std::string& sentence) { complain(node.Mark(), sentence); }

 private:
  void refuse_twice(const YAML::Node& map, int depth, int& most);
  void flatten(const YAML::Node& node, const YAML::Node& map, const std::string& field, int depth, std::vector<double>& out);

  std::string file_;
  YAML::Node root_;
  Error error_{ErrorCode::malformed, ""};
};

}  // namespace fbvins
