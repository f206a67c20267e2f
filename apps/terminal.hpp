// SPDX-License-Identifier: Apache-2.0
// Text for people: results go to stdout, everything else to stderr; colours only on a terminal.
#pragma once

#include <string>
#include <string_view>

namespace fbvins::app {

bool stderr_is_terminal();

/// Bold on a terminal, unless NO_COLOR is set (no-color.org).
std::string bold(std::string_view text);

/// Opens /dev/null for those of stdin, stdout and stderr that are closed, before a file gets their number.
void keep_standard_streams();

/// Text on stderr. What cannot be written, because the disk is full or nobody reads the pipe, is lost: no output of a flight
/// waits for it.
void tell(std::string_view text);

/// One line on stderr, with the program's name.
void note(std::string_view message);
void warn(std::string_view message);
/// The same in red; returns the exit code of bad input.
int fail(std::string_view message);

}  // namespace fbvins::app
