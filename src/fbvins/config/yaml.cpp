// SPDX-License-Identifier: Apache-2.0
#include "fbvins/config/yaml.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>

namespace fbvins {
namespace {

/// One reading of one text: carries what every error needs.
struct Reader {
  const std::string& source;
  const std::vector<OptionField>& fields;

  Error error(const YAML::Mark& mark, const std::string& message) const {
    return {ErrorCode::malformed, fmt::format("{}:{}: {}", source, mark.line + 1, message)};
  }

  const OptionField* find(const std::string& path) const {
    const auto it = std::find_if(fields.begin(), fields.end(), [&](const OptionField& f) { return f.path == path; });
    return it == fields.end() ? nullptr : &*it;
  }

  Result<void> unknown(const YAML::Mark& mark, const std::string& path) const {
    const std::string near = nearest_path(fields, path);
    return error(mark, fmt::format("unknown option '{}'{}", path, near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
  }

  Result<void> read_map(const YAML::Node& map, const std::string& prefix) const {
    std::set<std::string> seen;
    for (const auto& entry : map) {
      if (!entry.first.IsScalar()) return error(entry.first.Mark(), "the name of an option must be plain text");
      const std::string path = prefix + entry.first.Scalar();
      const OptionField* field = find(path);
      if (!field) return unknown(entry.first.Mark(), path);
      if (!seen.insert(path).second) return error(entry.first.Mark(), fmt::format("option '{}' is given twice", path));
      const Result<void> read = read_entry(*field, entry.first.Mark(), entry.second);
      if (!read) return read;
    }
    return {};
  }

  Result<void> read_entry(const OptionField& field, const YAML::Mark& mark, const YAML::Node& value) const {
    if (field.is_group()) {
      if (value.IsNull()) return {};
      if (!value.IsMap()) return error(mark, fmt::format("'{}' is a group of options, not a value", field.path));
      return read_map(value, field.path + ".");
    }
    if (!value.IsScalar())
      return error(mark, fmt::format("option '{}' wants a {}, not a list or group", field.path, field.type_name()));
    const bool quoted_number = value.Tag() == "!" && field.type_name() != "text";
    if (quoted_number)
      return error(mark,
                   fmt::format("option '{}': \"{}\" in quotes is text, not a {}", field.path, value.Scalar(), field.type_name()));
    const Result<void> set = field.set_from_text(value.Scalar());
    if (!set) return error(value.Mark(), fmt::format("option '{}': {}", field.path, set.error().message));
    return {};
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
  const Reader reader{source, fields};
  try {
    const YAML::Node root = YAML::Load(text);
    if (root.IsNull()) return {};
    if (!root.IsMap()) return reader.error(root.Mark(), "a configuration is a list of 'name: value' lines");
    return reader.read_map(root, "");
  } catch (const YAML::Exception& e) {
    return reader.error(e.mark, fmt::format("not YAML: {}", e.msg));
  }
}

Result<void> read_yaml_file(const std::string& path, const std::vector<OptionField>& fields) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorCode::not_found, fmt::format("{}: cannot be opened", path)};
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (file.bad()) return Error{ErrorCode::unreadable, fmt::format("{}: cannot be read", path)};
  return read_yaml(text, path, fields);
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
