// SPDX-License-Identifier: Apache-2.0
// Where text goes and whether it may be coloured: results to stdout, the rest to stderr.
#pragma once

#include <string>
#include <string_view>

namespace fbvins::app {

bool stderr_is_terminal();

/// Colours are for people: only on a terminal, and not where NO_COLOR is set (no-color.org).
std::string bold(std::string_view text);

/// One line on stderr, with the program's name: news, and what is wrong.
void note(std::string_view message);
void warn(std::string_view message);
/// The same in red; returns the exit code of bad input.
int fail(std::string_view message);

}  // namespace fbvins::app
