// SPDX-License-Identifier: Apache-2.0
// The configuration, by the names that `fbvins config --all` lists.
#include <fmt/format.h>

#include "bindings.hpp"
#include "fbvins/config/config_file.hpp"
#include "fbvins/config/option_fields.hpp"
#include "fbvins/config/yaml.hpp"

namespace fbvins::python {
namespace {

Config make_config(const std::string& file, const std::vector<std::string>& assignments) {
  return value_or_raise(load_config(file, assignments));
}

/// In its own type: bool, int, float or str.
nb::object value_of(const OptionField& field) {
  return std::visit(
      [](const auto& value) -> nb::object {
        using Value = std::decay_t<decltype(value)>;
        if constexpr (std::is_pointer_v<Value>) return nb::cast(*value);
        else return nb::none();
      },
      field.value);
}

nb::object item(Config config, const std::string& name) {
  const std::vector<OptionField> fields = fields_of(config);
  for (const OptionField& field : fields) {
    if (field.path != name || field.is_group()) continue;
    return std::holds_alternative<EnumValue>(field.value) ? nb::cast(field.value_text()) : value_of(field);
  }
  const std::string near = nearest_path(fields, name);
  throw nb::key_error(fmt::format("{}{}", name, near.empty() ? "" : fmt::format("; did you mean {}?", near)).c_str());
}

std::vector<std::string> names(Config config) {
  std::vector<std::string> out;
  for (const OptionField& field : fields_of(config))
    if (!field.is_group()) out.push_back(field.path);
  return out;
}

}  // namespace

void bind_config(nb::module_& m) {
  nb::class_<Config>(m, "Config", "Options of odometry, map and live sensors; `fbvins config --all` explains each.")
      .def(nb::new_(&make_config), "file"_a = "", "assignments"_a = std::vector<std::string>{},
           "The defaults, changed by a YAML file, then by 'name=value' assignments.")
      .def("__getitem__", &item, "name"_a, "The value of one option, such as config['estimator.max_iterations'].")
      .def("keys", &names, "Names of all options.")
      .def(
          "to_yaml", [](const Config& config) { return to_yaml(config); }, "Every option with value, meaning, unit and range.")
      .def("__reduce__", [](const Config& config) { return reduced("config", nb::cast(to_yaml(config))); })
      .def("__repr__", [](const Config& c) { return fmt::format("<fbvins.Config frontend.kind={}>", c.frontend.kind); });
  m.def("_restore_config", [](const std::string& yaml) {
    Config config;
    check(read_yaml(yaml, "the configuration", fields_of(config)));
    return config;
  });
}

}  // namespace fbvins::python
