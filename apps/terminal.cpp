// SPDX-License-Identifier: Apache-2.0
#include "apps/terminal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
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

void keep_standard_streams() {
  int descriptor = 0;
  while (descriptor >= 0 && descriptor <= STDERR_FILENO) descriptor = open("/dev/null", O_RDWR);  // the lowest free number
  if (descriptor > STDERR_FILENO) close(descriptor);
}

void tell(std::string_view text) {
  constexpr int kWait_ms = 1000;
  pollfd stream{STDERR_FILENO, POLLOUT, 0};
  if (poll(&stream, 1, kWait_ms) != 1 || (stream.revents & POLLOUT) == 0) return;
  (void)std::fwrite(text.data(), 1, text.size(), stderr);
}

void note(std::string_view message) { tell(fmt::format("fbvins: {}\n", message)); }

void warn(std::string_view message) { tell(fmt::format("fbvins: {} {}\n", painted(STDERR_FILENO, "33", "warning:"), message)); }

int fail(std::string_view message) {
  tell(fmt::format("fbvins: {} {}\n", painted(STDERR_FILENO, "31", "error:"), message));
  return kBadInput;
}

}  // namespace fbvins::app
