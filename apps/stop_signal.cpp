// SPDX-License-Identifier: Apache-2.0
#include "apps/stop_signal.hpp"

#include <semaphore.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <ctime>
#include <mutex>
#include <utility>

namespace fbvins::app {
namespace {

constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
/// `timeout` and shells send one signal twice, within milliseconds.
constexpr std::int64_t kDeliberate_ns = 500'000'000;

// What a signal handler uses has static storage.
sem_t g_wake;
std::atomic<std::int64_t> g_first_ns{0};  ///< of the first signal, on the monotonic clock; 0: none has come
std::atomic<bool> g_ended{false};
static_assert(std::atomic<std::int64_t>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

std::mutex g_mutex;
std::function<void()> g_on_stop;  // guarded by g_mutex

sigset_t stop_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : kSignals) sigaddset(&set, signal);
  return set;
}

/// Calls nothing that is not safe in a handler (signal-safety(7)).
void on_signal(int signal) {
  const int saved = errno;
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const std::int64_t now_ns = now.tv_sec * 1'000'000'000 + now.tv_nsec;
  std::int64_t first_ns = 0;
  if (!g_first_ns.compare_exchange_strong(first_ns, now_ns) && signal != SIGHUP && now_ns - first_ns >= kDeliberate_ns) {
    std::signal(signal, SIG_DFL);
    raise(signal);  // takes effect when this function returns
  }
  sem_post(&g_wake);
  errno = saved;
}

/// What was ignored from the start, as by nohup(1), stays ignored.
bool ignored(int signal) {
  struct sigaction old {};
  return sigaction(signal, nullptr, &old) == 0 && old.sa_handler == SIG_IGN;
}

void call_once() {
  const std::lock_guard lock(g_mutex);
  if (g_first_ns != 0 && g_on_stop) std::exchange(g_on_stop, nullptr)();
}

void take_signals() {
  const sigset_t set = stop_signals();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
  while (!g_ended)
    if (sem_wait(&g_wake) == 0) call_once();
}

}  // namespace

StopSignals::StopSignals() {
  sem_init(&g_wake, 0, 0);
  g_first_ns = 0;
  g_ended = false;
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  action.sa_mask = stop_signals();
  for (const int signal : kSignals)
    if (signal != SIGHUP || !ignored(signal)) sigaction(signal, &action, nullptr);
  // A reader that is gone, and a file at the limit of its size, are errors of that write.
  for (const int signal : {SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_IGN);
  const sigset_t set = stop_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  taker_ = std::thread(take_signals);
}

StopSignals::~StopSignals() {
  for (const int signal : kSignals)
    if (!ignored(signal)) std::signal(signal, SIG_DFL);
  g_ended = true;
  sem_post(&g_wake);
  taker_.join();
  sem_destroy(&g_wake);
  const sigset_t set = stop_signals();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

bool stop_is_wanted() { return g_first_ns != 0; }

StopSignal::StopSignal(std::function<void()> on_stop) {
  {
    const std::lock_guard lock(g_mutex);
    g_on_stop = std::move(on_stop);
  }
  sem_post(&g_wake);
}

StopSignal::~StopSignal() {
  const std::lock_guard lock(g_mutex);
  g_on_stop = nullptr;
}

}  // namespace fbvins::app
