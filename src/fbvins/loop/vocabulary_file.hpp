// SPDX-License-Identifier: Apache-2.0
// Where the vocabulary that ships with the project lies. Pure function of the machine, any thread.
//
//   Result<Vocabulary> vocabulary = Vocabulary::open(shipped_vocabulary());
#pragma once

#include <string>

namespace fbvins {

/// $FBVINS_VOCABULARY if set, else where it was installed, else the source tree this was built from.
std::string shipped_vocabulary();

}  // namespace fbvins
