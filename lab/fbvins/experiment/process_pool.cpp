// SPDX-License-Identifier: Apache-2.0
#include "fbvins/experiment/process_pool.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif

#include <cerrno>
#include <system_error>

namespace fbvins {
namespace {

/// In the child: only async-signal-safe calls between fork and exec.
[[noreturn]] void become(char* const* arguments, int log) {
#ifdef __linux__
  prctl(PR_SET_PDEATHSIG, SIGTERM);
#endif
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  execv(arguments[0], arguments);
  _exit(127);
}

}  // namespace

ProcessPool::~ProcessPool() {
  for (const auto& [pid, tag] : tags_) kill(pid, SIGTERM);
  while (running() > 0) wait();
}

Result<void> ProcessPool::start(int tag, const std::vector<std::string>& command, const std::string& log) {
  const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) return Error{ErrorCode::unwritable, log + ": " + std::generic_category().message(errno)};
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& a : command) arguments.push_back(const_cast<char*>(a.c_str()));
  arguments.push_back(nullptr);
  const pid_t pid = fork();
  if (pid == 0) become(arguments.data(), file);
  close(file);
  if (pid < 0) return Error{ErrorCode::unreadable, command.front() + ": " + std::generic_category().message(errno)};
  tags_[pid] = tag;
  return {};
}

ProcessPool::Ended ProcessPool::wait() {
  for (;;) {
    int status = 0;
    const pid_t pid = waitpid(-1, &status, 0);
    if (pid < 0 && errno == EINTR) continue;
    const auto at = pid < 0 ? tags_.begin() : tags_.find(pid);
    if (at == tags_.end()) continue;  // not a child of this pool
    const Ended ended{at->second, pid < 0 ? 127 : WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status)};
    tags_.erase(at);
    return ended;
  }
}

}  // namespace fbvins
