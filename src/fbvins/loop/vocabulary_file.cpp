// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/vocabulary_file.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>

namespace fbvins {

std::string shipped_vocabulary(const std::string& kind) {
  if (const char* chosen = std::getenv("FBVINS_VOCABULARY"); chosen != nullptr && *chosen != '\0') return chosen;
  const std::string name = "/" + kind + "_vocabulary.fbv", installed = FBVINS_INSTALLED_DATA + name;
  std::error_code ignored;
  return std::filesystem::exists(installed, ignored) ? installed : FBVINS_SOURCE_DATA + name;
}

Result<Vocabulary> open_vocabulary(const std::string& kind, const std::string& path) {
  auto vocabulary = Vocabulary::open(path.empty() ? shipped_vocabulary(kind) : path);
  if (vocabulary && vocabulary->kind() != kind)
    return Error{ErrorCode::invalid_argument,
                 fmt::format("the vocabulary is of '{}' descriptors, the map of '{}' ones", vocabulary->kind(), kind)};
  return vocabulary;
}

}  // namespace fbvins
