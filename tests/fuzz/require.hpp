// SPDX-License-Identifier: Apache-2.0
// What fuzz targets ask of a parser's answer; what is not so traps.
#pragma once

#include <string>

#include "fbvins/core/result.hpp"

namespace fbvins::fuzz {

inline void require(bool fact) {
  if (!fact) __builtin_trap();
}

/// An answer is a value or one sentence.
template <class T>
void require_sentence(const Result<T>& result) {
  if (result) return;
  require(!result.error().message.empty());
  require(result.error().message.find('\n') == std::string::npos);
}

}  // namespace fbvins::fuzz
