// SPDX-License-Identifier: Apache-2.0
// What fuzz targets require of a parser's result: require(false) stops the program with a trap.
#pragma once

#include <string>

#include "fbvins/core/result.hpp"

namespace fbvins::fuzz {

inline void require(bool fact) {
  if (!fact) __builtin_trap();
}

/// A result is a value or an error of one sentence.
template <class T>
void require_sentence(const Result<T>& result) {
  if (result) return;
  require(!result.error().message.empty());
  require(result.error().message.find('\n') == std::string::npos);
}

}  // namespace fbvins::fuzz
