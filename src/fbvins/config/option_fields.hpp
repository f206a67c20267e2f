// SPDX-License-Identifier: Apache-2.0
// Any Options struct (see core/options.hpp) as a flat list of fields that point into it, so that
// parsing, printing and setting need no template. A list is valid as long as the struct it was made of
// lives and stays where it is; one thread at a time.
//
//   KltFrontendOptions options;
//   for (const OptionField& f : fields_of(options)) use(f.path, f.value_text());
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "fbvins/core/result.hpp"

namespace fbvins {

/// An enum's value as one of its names.
struct EnumValue {
  std::function<std::size_t()> get;  ///< which of the names, from 0
  std::function<void(std::size_t)> set;
};

struct OptionField {
  std::string path;  ///< "klt.max_features"; of a group: "klt"
  std::string unit;  ///< "px", empty for pure numbers
  std::string meaning;
  std::string choices;      ///< of a text or an enum: allowed values separated by '|', empty for any text
  double min = 0, max = 0;  ///< of a number
  /// Pointer to the value; monostate for the heading of a group, whose fields follow it.
  std::variant<std::monostate, bool*, int*, double*, std::string*, EnumValue> value;

  bool is_group() const { return value.index() == 0; }
  int depth() const;               ///< number of groups around it
  std::string_view name() const;   ///< the path's last part
  std::string type_name() const;   ///< "true or false", "whole number", "number", "text"
  std::string value_text() const;  ///< the shortest text that reads back to the same bits
  std::string range_text() const;  ///< "[10, 5000]", "klt|orb" or nothing

  /// Reads a value of this field's type within its range; the error names neither file nor path.
  Result<void> set_from_text(const std::string& text) const;
};

/// The visitor that makes the list.
class FieldCollector {
 public:
  void operator()(std::string_view name, bool& value, std::string_view unit, std::string_view meaning) {
    add(name, unit, meaning, &value);
  }
  template <class T>
  void operator()(std::string_view name, T& value, std::string_view unit, std::string_view meaning, std::type_identity_t<T> min,
                  std::type_identity_t<T> max) {
    static_assert(std::is_same_v<T, int> || std::is_same_v<T, double>, "a number option is an int or a double");
    OptionField& field = add(name, unit, meaning, &value);
    field.min = static_cast<double>(min);
    field.max = static_cast<double>(max);
  }
  void operator()(std::string_view name, std::string& value, std::string_view choices, std::string_view meaning) {
    add(name, "", meaning, &value).choices = choices;
  }
  template <class Enum>
  requires std::is_enum_v<Enum>
  void operator()(std::string_view name, Enum& value, std::string_view names, std::string_view meaning) {
    const EnumValue access{[&value] { return static_cast<std::size_t>(value); },
                           [&value](std::size_t index) { value = static_cast<Enum>(index); }};
    add(name, "", meaning, access).choices = names;
  }
  template <class Group>
  void group(std::string_view name, Group& options, std::string_view meaning) {
    add(name, "", meaning, std::monostate{});
    const std::string outer = prefix_;
    prefix_ += std::string(name) + ".";
    options.visit(*this);
    prefix_ = outer;
  }
  std::vector<OptionField> take() { return std::move(fields_); }

 private:
  template <class Value>
  OptionField& add(std::string_view name, std::string_view unit, std::string_view meaning, Value value) {
    OptionField field;
    field.path = prefix_ + std::string(name);
    field.unit = unit;
    field.meaning = meaning;
    field.value = value;
    return fields_.emplace_back(std::move(field));
  }
  std::string prefix_;
  std::vector<OptionField> fields_;
};

template <class Options>
std::vector<OptionField> fields_of(Options& options) {
  FieldCollector collector;
  options.visit(collector);
  return collector.take();
}

/// The known path most similar to a wrong one (edit distance), or empty if none is.
std::string nearest_path(const std::vector<OptionField>& fields, std::string_view wrong);

/// "klt.max_features=200". The error names the path and, if unknown, the nearest one.
Result<void> set_option(const std::vector<OptionField>& fields, const std::string& assignment);

}  // namespace fbvins
