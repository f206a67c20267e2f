// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/vocabulary_file.hpp"

#include <fmt/format.h>

#include <cstdlib>

#include "fbvins/features/data_file.hpp"

namespace fbvins {

std::string shipped_vocabulary(const std::string& kind) {
  if (const char* chosen = std::getenv("FBVINS_VOCABULARY"); chosen != nullptr && *chosen != '\0') return chosen;
  return data_file(kind + "_vocabulary.fbv");
}

Result<Vocabulary> open_vocabulary(const std::string& kind, const std::string& path) {
  auto vocabulary = Vocabulary::open(path.empty() ? shipped_vocabulary(kind) : path);
  if (vocabulary && vocabulary->kind() != kind)
    return Error{ErrorCode::invalid_argument,
                 fmt::format("the vocabulary is of '{}' descriptors, the map of '{}' ones", vocabulary->kind(), kind)};
  return vocabulary;
}

}  // namespace fbvins
