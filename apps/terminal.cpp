// SPDX-License-Identifier: Apache-2.0
#include "apps/terminal.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "apps/commands.hpp"

namespace fbvins::app {
namespace {

bool may_colour(int descriptor) {
  const char* no_colour = std::getenv("NO_COLOR");  // NOLINT(concurrency-mt-unsafe): nobody writes the environment
  return isatty(descriptor) == 1 && (no_colour == nullptr || *no_colour == '\0');
}

std::string painted(int descriptor, std::string_view code, std::string_view text) {
  return may_colour(descriptor) ? fmt::format("\033[{}m{}\033[0m", code, text) : std::string(text);
}

}  // namespace

bool stderr_is_terminal() { return isatty(STDERR_FILENO) == 1; }

std::string bold(std::string_view text) { return painted(STDOUT_FILENO, "1", text); }

void note(std::string_view message) { fmt::print(stderr, "fbvins: {}\n", message); }

void warn(std::string_view message) { fmt::print(stderr, "fbvins: {} {}\n", painted(STDERR_FILENO, "33", "warning:"), message); }

int fail(std::string_view message) {
  fmt::print(stderr, "fbvins: {} {}\n", painted(STDERR_FILENO, "31", "error:"), message);
  return kBadInput;
}

}  // namespace fbvins::app
