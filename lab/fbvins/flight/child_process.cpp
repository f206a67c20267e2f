// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "fbvins/core/file_descriptor.hpp"

extern char** environ;  // NOLINT(readability-redundant-declaration): POSIX has no header that declares it

namespace fbvins {
namespace {

constexpr std::chrono::milliseconds kPatience{3'000}, kLookEvery{10};

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> all;
  for (std::string& text : texts) all.push_back(text.data());
  all.push_back(nullptr);
  return all;
}

}  // namespace

std::vector<std::string> environment_without(const std::string& without) {
  std::vector<std::string> all;
  for (char** entry = environ; *entry != nullptr; ++entry)
    if (std::strncmp(*entry, without.c_str(), without.size()) != 0) all.emplace_back(*entry);
  return all;
}

Result<void> ChildProcess::start(const ChildCommand& command) {
  const FileDescriptor file(open(command.log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)),
      nothing(open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (!file) return Error{ErrorCode::unwritable, fmt::format("{}: {}", command.log, std::strerror(errno))};
  std::vector<std::string> words = command.words, settings = command.environment;
  const std::vector<char*> arguments = pointers(words), variables = pointers(settings);
  pid_ = fork();
  if (pid_ == 0) {  // only calls that are safe between fork and exec
#ifdef __linux__
    prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
    if (chdir(command.folder.c_str()) != 0) _exit(127);
    dup2(nothing.number(), STDIN_FILENO);
    dup2(file.number(), STDOUT_FILENO);
    dup2(file.number(), STDERR_FILENO);
    execve(arguments[0], arguments.data(), variables.data());
    _exit(127);
  }
  if (pid_ < 0) return Error{ErrorCode::unreadable, fmt::format("{}: {}", words.front(), std::strerror(errno))};
  return {};
}

ChildProcess::~ChildProcess() {
  if (pid_ <= 0) return;
  kill(pid_, SIGTERM);
  const auto last = std::chrono::steady_clock::now() + kPatience;
  while (waitpid(pid_, nullptr, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() > last) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
      return;
    }
    std::this_thread::sleep_for(kLookEvery);
  }
}

}  // namespace fbvins
