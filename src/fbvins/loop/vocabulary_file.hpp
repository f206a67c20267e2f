// SPDX-License-Identifier: Apache-2.0
// Where the vocabulary that ships with the project lies. Pure function of the machine, any thread.
//
//   Result<Vocabulary> vocabulary = Vocabulary::open(shipped_vocabulary());
#pragma once

#include <string>

namespace fbvins {

/// Kinds of descriptors that words are made of.
inline constexpr const char *kRawDescriptors = "orb", *kBoostedDescriptors = "boosted";

/// $FBVINS_VOCABULARY if set, else where it was installed, else the source tree this was built from.
std::string shipped_vocabulary(const std::string& kind = kRawDescriptors);

}  // namespace fbvins
