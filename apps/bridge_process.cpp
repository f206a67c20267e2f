// SPDX-License-Identifier: Apache-2.0
#include "apps/bridge_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <utility>

namespace fbvins::app {
namespace {

using namespace std::chrono_literals;

constexpr int kPollMs = 200, kSilentPolls = 5;  ///< so long a last word waits, as it may be the reason of an end
constexpr auto kLetItEnd = 2s;                  ///< between SIGTERM and SIGKILL
constexpr auto kAgainAfter = 1s;                ///< between a failure and the next start
constexpr auto kLastDataWithin = 500ms;         ///< what a program sent before it ended regularly is still being read
constexpr std::size_t kLongestLine = 2000;      ///< what is longer is cut into several

/// After fork(): only what signal-safety(7) allows.
[[noreturn]] void become(char* const* arguments, int output, pid_t parent, const std::string& not_found) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // however this program ends, that one does not stay
  if (getppid() != parent) _exit(1);
  setpgid(0, 0);  // Ctrl-C in a terminal is for the estimator, which ends it
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  const int nothing = open("/dev/null", O_RDONLY);
  dup2(nothing, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  execvp(arguments[0], arguments);
  [[maybe_unused]] const auto written = write(STDERR_FILENO, not_found.data(), not_found.size());
  _exit(127);
}

bool starts_with_any(std::string_view line, std::initializer_list<std::string_view> words) {
  for (const std::string_view word : words)
    if (line.starts_with(word)) return true;
  return false;
}

std::string how(int status) {
  return WIFSIGNALED(status) ? fmt::format("signal {}", WTERMSIG(status)) : fmt::format("exit code {}", WEXITSTATUS(status));
}

}  // namespace

std::string BridgeWords::add(std::string_view line) {
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  if (starts_with_any(line, {"Traceback (most recent call last)", "During handling of the above", "The above exception was"}))
    in_traceback_ = true;
  if (in_traceback_) {
    if (line.empty() || starts_with_any(line, {"Traceback ", " ", "During ", "The above "})) return "";
    in_traceback_ = false;
    failure_ = line.starts_with("RuntimeError: ") ? line.substr(14) : line;
    return "";
  }
  if (line.empty() || (!command_.own_path.empty() && line.find(command_.own_path) != std::string_view::npos)) return "";
  last_ = line;
  return std::exchange(waiting_, std::string(line));
}

std::string BridgeWords::take() { return std::exchange(waiting_, ""); }

std::string BridgeWords::reason() const {
  const std::string& why = failure_.empty() ? last_ : failure_;
  // A package of an old version lacks names, too.
  if (!starts_with_any(failure_, {"ModuleNotFoundError", "ImportError", "AttributeError: module"})) return why;
  return fmt::format("`pip install {}` ({})", command_.packages, failure_);
}

BridgeProcess::BridgeProcess(BridgeCommand command, Say say, std::function<void()> on_end)
    : command_(std::move(command)), say_(std::move(say)), on_end_(std::move(on_end)) {
  watcher_ = std::thread([this] { watch(); });
}

BridgeProcess::~BridgeProcess() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  watcher_.join();
}

Result<void> BridgeProcess::end() const {
  const std::lock_guard lock(mutex_);
  return end_;
}

void BridgeProcess::wait_for_end(double longest_s) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::duration<double>(longest_s), [this] { return over_.load(); });
}

/// The thread whose children the programs are: they live as long as it does at most (PR_SET_PDEATHSIG).
void BridgeProcess::watch() {
  Result<void> ended;
  while (!stopping_) {
    const bool again = run_once(ended) && came_;
    if (stopping_) return;
    std::unique_lock lock(mutex_);
    if (!again) {
      changed_.wait_for(lock, came_ ? kLastDataWithin : 0ms, [this] { return stopping_.load(); });
      end_ = ended;
      over_ = true;
      break;
    }
    say_(ended.error().message + "; it is started again");
    changed_.wait_for(lock, kAgainAfter, [this] { return stopping_.load(); });
  }
  changed_.notify_all();
  if (!stopping_) on_end_();
}

/// Until the program ends, or is to end. Whether it failed.
bool BridgeProcess::run_once(Result<void>& ended) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    ended = Error{ErrorCode::unreadable, fmt::format("{}: its program cannot be started: no pipe", command_.name)};
    return true;
  }
  child_ = start(ends[1]);
  close(ends[1]);
  BridgeWords words(command_);
  const auto say = [&](const std::string& sentence) {
    if (!sentence.empty()) say_(fmt::format("{}: {}", command_.name, sentence));
  };
  std::string line;
  int status = 0;
  bool dead = child_ < 0;
  int silent = 0;
  while (!dead && !stopping_) {
    pollfd wait{ends[0], POLLIN, 0};
    const int ready = poll(&wait, 1, kPollMs);
    std::array<char, 4096> bytes{};
    const ssize_t n = ready > 0 ? read(ends[0], bytes.data(), bytes.size()) : 0;
    for (const char c : std::string_view(bytes.data(), n > 0 ? static_cast<std::size_t>(n) : 0))
      if (c == '\n' || line.size() >= kLongestLine) say(words.add(std::exchange(line, c == '\n' ? "" : std::string(1, c))));
      else line += c;
    silent = n > 0 ? 0 : silent + 1;
    if (n > 0) continue;
    dead = is_dead(status);
    if (!dead && silent >= kSilentPolls) say(words.take());
    if (!dead && ready > 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(kPollMs));  // it has closed its output, and lives
  }
  close(ends[0]);
  if (!dead) terminate(status);
  if (!line.empty()) words.add(line);
  const std::string why = words.reason();
  ended = {};
  if (came_ && WIFEXITED(status) && WEXITSTATUS(status) == 0) return false;
  ended = Error{ErrorCode::unreadable,
                fmt::format("{}: {}", command_.name, why.empty() ? "its program has ended (" + how(status) + ")" : why)};
  return true;
}

pid_t BridgeProcess::start(int output) const {
  std::vector<char*> arguments;
  for (const std::string& argument : command_.arguments) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  const std::string not_found =
      fmt::format("{} cannot be started: install Python 3, or name it by FBVINS_PYTHON\n", command_.arguments.front());
  const pid_t parent = getpid(), child = fork();
  if (child == 0) become(arguments.data(), output, parent, not_found);
  setpgid(child, child);  // as the child does itself: terminate() needs the group whichever of the two runs first
  return child;
}

bool BridgeProcess::is_dead(int& status) const { return waitpid(child_, &status, WNOHANG) == child_; }

/// Itself and what it has started.
void BridgeProcess::terminate(int& status) const {
  kill(-child_, SIGTERM);
  const auto until = std::chrono::steady_clock::now() + kLetItEnd;
  while (std::chrono::steady_clock::now() < until) {
    if (is_dead(status)) return;
    std::this_thread::sleep_for(10ms);
  }
  kill(-child_, SIGKILL);
  waitpid(child_, &status, 0);
}

}  // namespace fbvins::app
