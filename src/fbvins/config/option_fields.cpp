// SPDX-License-Identifier: Apache-2.0
#include "fbvins/config/option_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "fbvins/core/text.hpp"

namespace fbvins {
namespace {

Error invalid(std::string message) { return {ErrorCode::invalid_argument, std::move(message)}; }

template <class T>
Result<void> set_number(const OptionField& field, const std::string& text, T& target) {
  const std::optional<T> value = number_in<T>(std::string_view(text).substr(text.starts_with('+') ? 1 : 0));
  if (!value || !std::isfinite(static_cast<double>(*value)))
    return invalid(fmt::format("'{}' is not a {}", text, field.type_name()));
  const auto number = static_cast<double>(*value);
  if (number < field.min || number > field.max)
    return invalid(fmt::format("{} is outside {}{}{}", text, field.range_text(), field.unit.empty() ? "" : " ", field.unit));
  target = *value;
  return {};
}

Result<void> set_bool(const std::string& text, bool& target) {
  if (text != "true" && text != "false") return invalid(fmt::format("'{}' is not true or false", text));
  target = text == "true";
  return {};
}

/// Which of the choices the text is.
Result<std::size_t> choice(const OptionField& field, const std::string& text) {
  const std::vector<std::string> names = split(field.choices, '|');
  const auto it = std::find(names.begin(), names.end(), text);
  if (it == names.end()) return invalid(fmt::format("'{}' is none of {}", text, field.choices));
  return static_cast<std::size_t>(it - names.begin());
}

Result<void> set_text(const OptionField& field, const std::string& text, std::string& target) {
  if (!field.choices.empty())
    if (const auto index = choice(field, text); !index) return index.error();
  target = text;
  return {};
}

Result<void> set_enum(const OptionField& field, const std::string& text, const EnumValue& target) {
  const auto index = choice(field, text);
  if (!index) return index.error();
  target.set(*index);
  return {};
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replace = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replace, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

std::string_view last_part(std::string_view path) {
  const auto dot = path.rfind('.');
  return dot == std::string_view::npos ? path : path.substr(dot + 1);
}

}  // namespace

int OptionField::depth() const { return static_cast<int>(std::count(path.begin(), path.end(), '.')); }

std::string_view OptionField::name() const { return last_part(path); }

std::string OptionField::type_name() const {
  constexpr const char* kNames[] = {"group", "true or false", "whole number", "number", "text", "text"};
  return kNames[value.index()];
}

std::string OptionField::value_text() const {
  if (auto* flag = std::get_if<bool*>(&value)) return **flag ? "true" : "false";
  if (auto* whole = std::get_if<int*>(&value)) return fmt::format("{}", **whole);
  if (auto* number = std::get_if<double*>(&value)) return fmt::format("{}", **number);
  if (auto* text = std::get_if<std::string*>(&value)) return **text;
  if (auto* chosen = std::get_if<EnumValue>(&value)) return split(choices, '|').at(chosen->get());
  return {};
}

std::string OptionField::range_text() const {
  if (std::holds_alternative<int*>(value) || std::holds_alternative<double*>(value)) return fmt::format("[{}, {}]", min, max);
  return choices;
}

Result<void> OptionField::set_from_text(const std::string& text) const {
  if (auto* flag = std::get_if<bool*>(&value)) return set_bool(text, **flag);
  if (auto* whole = std::get_if<int*>(&value)) return set_number(*this, text, **whole);
  if (auto* number = std::get_if<double*>(&value)) return set_number(*this, text, **number);
  if (auto* target = std::get_if<std::string*>(&value)) return set_text(*this, text, **target);
  if (auto* target = std::get_if<EnumValue>(&value)) return set_enum(*this, text, *target);
  return invalid("is a group of options, not a value");
}

std::string nearest_path(const std::vector<OptionField>& fields, std::string_view wrong) {
  std::string best;
  std::size_t least = std::max<std::size_t>(2, last_part(wrong).size() / 3) + 1;
  for (const OptionField& field : fields) {
    // A right name in the wrong group is nearer than a wrong name in the right one.
    const std::size_t elsewhere = edit_distance(field.name(), last_part(wrong)) + 1;
    const std::size_t distance = std::min(edit_distance(field.path, wrong), elsewhere);
    if (distance < least) {
      least = distance;
      best = field.path;
    }
  }
  return best;
}

Result<void> set_option(const std::vector<OptionField>& fields, const std::string& assignment) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos) return invalid(fmt::format("'{}' is not of the form name=value", assignment));
  const std::string path = assignment.substr(0, equals);
  const auto field = std::find_if(fields.begin(), fields.end(), [&](const OptionField& f) { return f.path == path; });
  if (field == fields.end()) {
    const std::string near = nearest_path(fields, path);
    return invalid(fmt::format("unknown option '{}'{}", path, near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
  }
  const Result<void> set = field->set_from_text(assignment.substr(equals + 1));
  if (!set) return invalid(fmt::format("option '{}': {}", path, set.error().message));
  return {};
}

}  // namespace fbvins
