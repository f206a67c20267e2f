// SPDX-License-Identifier: Apache-2.0
// Private: what a file is that is no recording: by its first bytes, its words or its rows. For people.
//
//   if (const auto known = known_file("poses.txt")) print(known->what, known->use);
#pragma once

#include <optional>
#include <string>

namespace fbvins {

struct KnownFile {
  std::string what;  ///< "a trajectory of 340 poses over 16.9 s"
  std::string use;   ///< "`fbvins eval` compares it with another"
};

/// None where nobody here knows it, or it cannot be read.
std::optional<KnownFile> known_file(const std::string& path);

}  // namespace fbvins
