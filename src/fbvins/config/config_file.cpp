// SPDX-License-Identifier: Apache-2.0
#include "fbvins/config/config_file.hpp"

#include "fbvins/config/option_fields.hpp"
#include "fbvins/config/yaml.hpp"
#include "fbvins/core/options.hpp"

namespace fbvins {

Result<Config> load_config(const std::string& path) { return load_config(path, {}); }

Result<Config> load_config(const std::string& path, const std::vector<std::string>& assignments) {
  Config config;
  const std::vector<OptionField> fields = fields_of(config);
  if (!path.empty())
    if (Result<void> read = read_yaml_file(path, fields); !read) return read.error();
  for (const std::string& assignment : assignments)
    if (Result<void> set = set_option(fields, assignment); !set) return set.error();
  if (Result<void> valid = validate(config); !valid) return valid.error();
  return config;
}

std::string to_yaml(Config config) { return write_yaml(fields_of(config)); }

}  // namespace fbvins
