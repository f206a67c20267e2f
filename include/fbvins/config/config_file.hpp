// SPDX-License-Identifier: Apache-2.0
// The configuration of the whole system, from a file and back. One thread at a time.
//
//   Result<Config> config = load_config("config/euroc.yaml");
//   if (!config) report(config.error().message);   // "config/euroc.yaml:12: unknown option ..."
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/config/config.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

/// The defaults, changed by the file. From a flight record (MCAP), the configuration of that flight.
Result<Config> load_config(const std::string& path);

/// Options for one kind of computer, measured together (docs/service.md).
struct Profile {
  std::string_view name, meaning;
  std::vector<std::string> settings;  ///< "name=value"
};
std::span<const Profile> profiles();

/// The defaults, changed by the profile of that name (empty: none), by the file (none for an empty path), then by "name=value"
/// assignments in order.
Result<Config> load_config(const std::string& path, const std::vector<std::string>& assignments, std::string_view profile = "");

/// Every option with its value, meaning, unit and range; load_config reads the same configuration back.
std::string to_yaml(Config config);

}  // namespace fbvins
