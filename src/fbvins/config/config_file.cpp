// SPDX-License-Identifier: Apache-2.0
#include "fbvins/config/config_file.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "fbvins/config/option_fields.hpp"
#include "fbvins/config/yaml.hpp"
#include "fbvins/core/options.hpp"

namespace fbvins {

Result<Config> load_config(const std::string& path) { return load_config(path, {}); }

std::span<const Profile> profiles() {
  static const std::vector<Profile> all{
      {"a55",
       "boards whose cores are as slow as a Cortex-A55 (RK3566, OAK)",
       {"frontend.kind=klt", "frontend.klt.max_features=90", "estimator.keyframes.max_keyframes=6",
        "estimator.max_iterations=3"}},
  };
  return all;
}

Result<Config> load_config(const std::string& path, const std::vector<std::string>& assignments, std::string_view profile) {
  Config config;
  const std::vector<OptionField> fields = fields_of(config);
  if (!profile.empty()) {
    const auto found = std::ranges::find(profiles(), profile, &Profile::name);
    if (found == profiles().end()) return Error{ErrorCode::invalid_argument, fmt::format("there is no profile '{}'", profile)};
    for (const std::string& setting : found->settings)
      if (Result<void> set = set_option(fields, setting); !set) return set.error();
  }
  if (!path.empty())
    if (Result<void> read = read_yaml_file(path, fields); !read) return read.error();
  for (const std::string& assignment : assignments)
    if (Result<void> set = set_option(fields, assignment); !set) return set.error();
  if (Result<void> valid = validate(config); !valid) return valid.error();
  return config;
}

std::string to_yaml(Config config) { return write_yaml(fields_of(config)); }

}  // namespace fbvins
