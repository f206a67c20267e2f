// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/yaml_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

constexpr int kMostLooked = 10'000, kDeepestLooked = 3;

/// Makes the OpenCV header a comment, keeping the number of lines. No other YAML directive may follow it.
void hide_opencv_header(std::string& text) {
  std::size_t start = text.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  if (text.compare(start, 6, "%YAML:") == 0) text[start] = '#';
}

std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 32; }, ' ');
  return text;
}

/// The first line that a tab indents, from 1; 0 where none is.
int line_with_tab(const std::string& text) {
  int number = 1;
  for (std::size_t at = 0; at < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', at), text.size()), first = text.find_first_not_of(" \t\r", at);
    if (first < end && text[first] != '#' && text.find('\t', at) < first) return number;
    at = end + 1;
  }
  return 0;
}

}  // namespace

YamlReader::YamlReader(std::string file, std::string text, Root root) : file_(std::move(file)) {
  hide_opencv_header(text);
  try {
    root_ = YAML::Load(text);
    if (root == Root::fields && !root_.IsMap()) error_.message = fmt::format("{}: holds no fields", file_);
    int most = kMostLooked;
    refuse_twice(root_, 0, most);
  } catch (const YAML::Exception& e) {
    if (const int tab = line_with_tab(text); tab > 0)
      error_.message = fmt::format("{}:{}: begins with a tab: YAML is indented by blanks", file_, tab);
    else complain(e.mark, "not YAML: " + one_line(e.msg));
  } catch (const std::exception& e) {
    error_.message = fmt::format("{}: {}", file_, one_line(e.what()));
  }
  if (!ok()) root_ = YAML::Node();
}

/// Of a field that is there twice one would be taken, and nobody would know which. `most`: values that are looked at, as an alias
/// may stand for very many.
void YamlReader::refuse_twice(const YAML::Node& map, int depth, int& most) {
  if (!map.IsMap() || depth > kDeepestLooked) return;
  std::map<std::string, int> lines;
  for (const auto& entry : map) {
    if (--most < 0) return;
    if (!entry.first.IsScalar()) continue;
    const int line = entry.first.Mark().line + 1;
    const auto [before, is_new] = lines.try_emplace(entry.first.Scalar(), line);
    if (!is_new)
      complain(entry.first, fmt::format("'{}' is there twice, first in line {}", one_line(entry.first.Scalar().substr(0, 80)),
                                        before->second));
    refuse_twice(entry.second, depth + 1, most);
  }
}

YAML::Node YamlReader::get(const YAML::Node& map, const std::string& field) const {
  if (!map.IsDefined() || !map.IsMap()) return YAML::Node(YAML::NodeType::Undefined);
  for (const auto& entry : map)
    if (entry.first.IsScalar() && entry.first.Scalar() == field) return entry.second;
  return YAML::Node(YAML::NodeType::Undefined);
}

void YamlReader::complain(const YAML::Node& map, const std::string& field, const std::string& sentence) {
  if (!ok()) return;
  const YAML::Node node = get(map, field);
  const YAML::Node& where = node.IsDefined() ? node : map;
  if (where.IsDefined() && !where.is(root_)) complain(where, fmt::format("{}: {}", field, sentence));
  else error_.message = fmt::format("{}: {}: {}", file_, field, sentence);
}

void YamlReader::complain(const YAML::Mark& mark, const std::string& sentence) {
  if (ok()) error_.message = fmt::format("{}:{}: {}", file_, mark.line + 1, sentence);
}

double YamlReader::number(const YAML::Node& map, const std::string& field) {
  const YAML::Node node = get(map, field);
  if (!node.IsDefined()) return complain(map, field, "is missing"), 0.0;
  const auto value = node.IsScalar() ? parse_double(node.Scalar()) : std::nullopt;
  if (!value || !std::isfinite(*value)) return complain(map, field, "is not a number"), 0.0;
  return *value;
}

double YamlReader::positive(const YAML::Node& map, const std::string& field) {
  const double value = number(map, field);
  if (value > 0) return value;
  complain(map, field, fmt::format("{} is not positive", value));
  return 1.0;
}

std::string YamlReader::word(const YAML::Node& map, const std::string& field) {
  const YAML::Node node = get(map, field);
  if (!node.IsDefined()) return complain(map, field, "is missing"), "";
  if (!node.IsScalar()) return complain(map, field, "is not a word"), "";
  return one_line(node.Scalar().substr(0, 80));
}

void YamlReader::flatten(const YAML::Node& node, const YAML::Node& map, const std::string& field, int depth,
                         std::vector<double>& out) {
  constexpr int kDeepest = 2;
  constexpr std::size_t kMost = 64;
  if (node.IsSequence() && depth < kDeepest) {
    for (const auto& item : node)
      if (out.size() <= kMost) flatten(item, map, field, depth + 1, out);
    return;
  }
  const auto value = node.IsScalar() ? parse_double(node.Scalar()) : std::nullopt;
  if (!value || !std::isfinite(*value)) complain(map, field, "holds something that is not a number");
  out.push_back(value.value_or(0.0));
}

std::vector<double> YamlReader::numbers(const YAML::Node& map, const std::string& field) {
  std::vector<double> out;
  const YAML::Node node = get(map, field);
  if (!node.IsDefined()) complain(map, field, "is missing");
  else if (!node.IsSequence()) complain(map, field, "is not a list of numbers");
  else flatten(node, map, field, 0, out);
  return out;
}

double YamlReader::number_between(const YAML::Node& map, const std::string& field, double low, double high, double otherwise) {
  const YAML::Node node = get(map, field);
  if (!node.IsDefined()) return otherwise;
  const auto value = node.IsScalar() ? parse_double(node.Scalar()) : std::nullopt;
  if (value && *value >= low && *value <= high) return *value;
  complain(node, fmt::format("'{}' must be a number from {} to {}", field, low, high));
  return otherwise;
}

std::string YamlReader::text(const YAML::Node& map, const std::string& field) {
  const YAML::Node node = get(map, field);
  if (!node.IsDefined()) return "";
  if (!node.IsScalar()) return complain(node, fmt::format("'{}' must be a single value", field)), "";
  return node.Scalar();
}

std::vector<std::string> YamlReader::texts(const YAML::Node& map, const std::string& field) {
  const YAML::Node node = get(map, field);
  if (!node.IsDefined()) return {};
  if (node.IsScalar()) return {node.Scalar()};
  if (!node.IsSequence()) return complain(node, fmt::format("'{}' must be a list", field)), std::vector<std::string>{};
  std::vector<std::string> out;
  for (const YAML::Node& item : node) {
    if (!item.IsScalar()) complain(item, fmt::format("'{}' must be a list of plain values", field));
    else out.push_back(item.Scalar());
  }
  return out;
}

void YamlReader::only(const YAML::Node& map, std::initializer_list<const char*> known) {
  if (!map.IsMap()) return complain(map, "names and values are wanted here");
  for (const auto& entry : map) {
    const std::string name = entry.first.IsScalar() ? one_line(entry.first.Scalar().substr(0, 80)) : "";
    if (std::find(known.begin(), known.end(), name) == known.end())
      complain(entry.first, fmt::format("unknown key '{}'; known here: {}", name, fmt::join(known, ", ")));
  }
}

std::vector<double> YamlReader::numbers(const YAML::Node& map, const std::string& field, std::size_t count) {
  std::vector<double> out = numbers(map, field);
  if (out.size() != count) complain(map, field, fmt::format("has {} numbers where {} are needed", out.size(), count));
  out.resize(count, 0.0);
  return out;
}

}  // namespace fbvins
