// SPDX-License-Identifier: Apache-2.0
// Private: text of strangers, of files or senders, in messages.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

namespace fbvins {

/// Printable, on one line.
inline std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

/// The same, and short.
inline std::string quoted(std::string_view text) { return printable(std::string(text.substr(0, 40))); }

}  // namespace fbvins
