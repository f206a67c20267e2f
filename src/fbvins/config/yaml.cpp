// SPDX-License-Identifier: Apache-2.0
#include "fbvins/config/yaml.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "fbvins/io/file_source.hpp"
#include "fbvins/io/mcap_dataset.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestConfig_bytes = 1u << 20u;

/// Sets the options that a text names; the reader keeps the first error.
struct OptionReader {
  YamlReader& yaml;
  const std::vector<OptionField>& fields;

  const OptionField* find(const std::string& path) const {
    const auto it = std::find_if(fields.begin(), fields.end(), [&](const OptionField& f) { return f.path == path; });
    return it == fields.end() ? nullptr : &*it;
  }

  void complain_unknown(const YAML::Node& name, const std::string& path) const {
    const std::string near = nearest_path(fields, path);
    yaml.complain(name,
                  fmt::format("unknown option '{}'{}", path, near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
  }

  void read_map(const YAML::Node& map, const std::string& prefix) const {
    std::set<std::string> seen;
    for (const auto& entry : map) {
      if (!yaml.ok()) return;
      if (!entry.first.IsScalar()) return yaml.complain(entry.first, "the name of an option must be plain text");
      const std::string path = prefix + entry.first.Scalar();
      const OptionField* field = find(path);
      if (!field) return complain_unknown(entry.first, path);
      if (!seen.insert(path).second) return yaml.complain(entry.first, fmt::format("option '{}' is given twice", path));
      read_entry(*field, entry.first, entry.second);
    }
  }

  void read_entry(const OptionField& field, const YAML::Node& name, const YAML::Node& value) const {
    if (field.is_group()) {
      if (value.IsNull()) return;
      if (!value.IsMap()) return yaml.complain(name, fmt::format("'{}' is a group of options, not a value", field.path));
      return read_map(value, field.path + ".");
    }
    if (!value.IsScalar())
      return yaml.complain(name, fmt::format("option '{}' must be a {}, not a list or group", field.path, field.type_name()));
    const bool quoted_number = value.Tag() == "!" && field.type_name() != "text";
    if (quoted_number)
      return yaml.complain(
          name, fmt::format("option '{}': \"{}\" in quotes is text, not a {}", field.path, value.Scalar(), field.type_name()));
    const Result<void> set = field.set_from_text(value.Scalar());
    if (!set) yaml.complain(value, fmt::format("option '{}': {}", field.path, set.error().message));
  }
};

/// A double-quoted YAML scalar; control characters as \xNN.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') out += fmt::format("\\{}", c);
    else if (code < 0x20 || code == 0x7f) out += fmt::format("\\x{:02x}", code);
    else out += c;
  }
  return out + "\"";
}

std::string comment_of(const OptionField& field) {
  std::string comment = field.meaning;
  const std::string range = field.range_text();
  if (!field.unit.empty()) comment += fmt::format(" [{}]", field.unit);
  if (!range.empty()) comment += fmt::format(" {}", range.front() == '[' ? "in " + range : "(" + range + ")");
  return comment;
}

}  // namespace

Result<void> read_yaml(const std::string& text, const std::string& source, const std::vector<OptionField>& fields) {
  YamlReader yaml(source, text, YamlReader::Root::anything);
  if (yaml.ok() && !yaml.root().IsNull()) {
    if (!yaml.root().IsMap()) yaml.complain(yaml.root(), "a configuration is a list of 'name: value' lines");
    else OptionReader{yaml, fields}.read_map(yaml.root(), "");
  }
  if (!yaml.ok()) return yaml.error();
  return {};
}

Result<void> read_yaml_file(const std::string& path, const std::vector<OptionField>& fields) {
  const bool record = is_mcap(path);
  const Result<std::string> text = record ? recorded_configuration(path) : read_file(path, kLargestConfig_bytes);
  if (!text) return text.error();
  return read_yaml(*text, record ? path + ": config.yaml" : path, fields);
}

std::string write_yaml(const std::vector<OptionField>& fields) {
  std::string out;
  for (const OptionField& field : fields) {
    const std::string indent(static_cast<std::size_t>(2 * field.depth()), ' ');
    if (field.is_group()) {
      out += fmt::format("{}{}:  # {}\n", indent, field.name(), field.meaning);
      continue;
    }
    // Free text is quoted, or "null" and "12" would be read as something else by other programs.
    const bool free_text = std::holds_alternative<std::string*>(field.value) && field.choices.empty();
    const std::string value = free_text ? quoted(field.value_text()) : field.value_text();
    out += fmt::format("{}{}: {}  # {}\n", indent, field.name(), value, comment_of(field));
  }
  return out;
}

}  // namespace fbvins
