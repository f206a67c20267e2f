// SPDX-License-Identifier: Apache-2.0
// Paths and reading of the vocabularies that ship with the project. Only reads files; any thread.
//
//   Result<Vocabulary> vocabulary = open_vocabulary(kRawDescriptors);
#pragma once

#include <string>

#include "fbvins/loop/vocabulary.hpp"

namespace fbvins {

/// Kinds of descriptors that words are made of.
inline constexpr const char *kRawDescriptors = "orb", *kBoostedDescriptors = "boosted";

/// $FBVINS_VOCABULARY if set, else by data_file(): beside the program, installed, or in the sources.
std::string shipped_vocabulary(const std::string& kind = kRawDescriptors);

/// The one that ships for this kind of descriptors, or the one at `path`, which must be of that kind.
Result<Vocabulary> open_vocabulary(const std::string& kind, const std::string& path = {});

}  // namespace fbvins
