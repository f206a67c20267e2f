// SPDX-License-Identifier: Apache-2.0
#include "apps/stop_signal.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <thread>

namespace fbvins::app {
namespace stop_signal_test {

using namespace std::chrono_literals;

/// What a process of its own, which may be killed, returned: its exit code, or minus the signal that ended it.
template <class Body>
int in_a_process(const Body& body) {
  const pid_t child = fork();
  if (child == 0) {
    alarm(60);
    _exit(body());
  }
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
}

/// As a library's, made before main(): it blocks no signal.
void make_a_foreign_thread() {
  std::thread([] {
    while (true) pause();
  }).detach();
}

bool comes_true(const std::function<bool()>& fact) {
  for (int i = 0; i < 20'000; ++i, std::this_thread::sleep_for(1ms))
    if (fact()) return true;
  return false;
}

/// 0: the signal stopped the flight, once, and the rest of the program ran.
int stops_regularly(int signal) {
  return in_a_process([signal] {
    make_a_foreign_thread();
    const StopSignals signals;
    std::atomic<int> stops{0};
    const StopSignal stop([&] { ++stops; });
    if (stop_is_wanted()) return 1;
    kill(getpid(), signal);
    if (!comes_true([&] { return stops > 0; })) return 2;
    return stop_is_wanted() && stops == 1 ? 0 : 3;
  });
}

TEST(StopSignals, StopRegularlyWhereAThreadWasThereBefore) {
  EXPECT_EQ(stops_regularly(SIGTERM), 0);
  EXPECT_EQ(stops_regularly(SIGINT), 0);
  EXPECT_EQ(stops_regularly(SIGHUP), 0);
}

TEST(StopSignals, OneThatCameBeforeThereWasAnythingToStopIsNotLost) {
  EXPECT_EQ(in_a_process([] {
              const StopSignals signals;
              kill(getpid(), SIGTERM);
              if (!comes_true(stop_is_wanted)) return 1;
              std::atomic<bool> stopped{false};
              const StopSignal stop([&] { stopped = true; });
              return comes_true([&] { return stopped.load(); }) ? 0 : 2;
            }),
            0);
}

TEST(StopSignals, TheSameOneTwiceAtOnceIsOne) {
  EXPECT_EQ(in_a_process([] {
              const StopSignals signals;
              for (int i = 0; i < 10; ++i) kill(getpid(), SIGTERM);
              return comes_true(stop_is_wanted) ? 0 : 1;
            }),
            0);
}

TEST(StopSignals, ALaterSecondOneEndsAtOnce) {
  EXPECT_EQ(in_a_process([] {
              const StopSignals signals;
              kill(getpid(), SIGINT);
              comes_true(stop_is_wanted);
              std::this_thread::sleep_for(600ms);
              kill(getpid(), SIGTERM);
              std::this_thread::sleep_for(20s);
              return 0;
            }),
            -SIGTERM);
}

TEST(StopSignals, ATerminalThatHangsUpTwiceDoesNotEndAtOnce) {
  EXPECT_EQ(in_a_process([] {
              const StopSignals signals;
              kill(getpid(), SIGHUP);
              comes_true(stop_is_wanted);
              std::this_thread::sleep_for(600ms);
              kill(getpid(), SIGHUP);
              std::this_thread::sleep_for(100ms);
              return 0;
            }),
            0);
}

TEST(StopSignals, NohupStays) {
  EXPECT_EQ(in_a_process([] {
              signal(SIGHUP, SIG_IGN);
              const StopSignals signals;
              kill(getpid(), SIGHUP);
              std::this_thread::sleep_for(100ms);
              return stop_is_wanted() ? 1 : 0;
            }),
            0);
}

TEST(StopSignals, AReaderThatIsGoneIsAnErrorOfTheWrite) {
  EXPECT_EQ(in_a_process([] {
              const StopSignals signals;
              int ends[2];
              if (pipe(ends) != 0) return 1;
              close(ends[0]);
              return write(ends[1], "x", 1) == -1 && errno == EPIPE ? 0 : 2;
            }),
            0);
}

TEST(StopSignals, SystemCallsOfOtherThreadsAreNotInterrupted) {
  EXPECT_EQ(in_a_process([] {
              const StopSignals signals;
              std::thread([main_thread = getpid()] {
                std::this_thread::sleep_for(50ms);
                kill(main_thread, SIGTERM);
              }).detach();
              const timespec rest{.tv_sec = 0, .tv_nsec = 300'000'000};
              return nanosleep(&rest, nullptr) == 0 && stop_is_wanted() ? 0 : 1;
            }),
            0);
}

}  // namespace stop_signal_test
}  // namespace fbvins::app
