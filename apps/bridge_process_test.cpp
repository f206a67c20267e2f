// SPDX-License-Identifier: Apache-2.0
#include "apps/bridge_process.hpp"

#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace fbvins::app {
namespace bridge_process_test {

using namespace std::chrono_literals;

/// A shell in the place of a bridge, and what is said of it.
struct Shell {
  explicit Shell(const std::string& script)
      : process(
            BridgeCommand{"oak", {"/bin/sh", "-c", script}, "depthai numpy", "/private/s"},
            [this](const std::string& sentence) {
              const std::lock_guard lock(mutex);
              said.push_back(sentence);
            },
            [this] { ends = ends + 1; }) {}
  std::vector<std::string> sentences() {
    const std::lock_guard lock(mutex);
    return said;
  }
  std::mutex mutex;
  std::vector<std::string> said;
  std::atomic<int> ends = 0;
  BridgeProcess process;
};

template <class Condition>
bool soon(const Condition& condition) {
  for (int k = 0; k < 1000; ++k, std::this_thread::sleep_for(10ms))
    if (condition()) return true;
  return false;
}

TEST(BridgeWords, OfATracebackTheLastLineIsTheReason) {
  const BridgeCommand command{"d435i", {}, "pyrealsense2 numpy", "/private/s"};
  BridgeWords words(command);
  EXPECT_EQ(words.add("connected to /private/s"), "");
  EXPECT_EQ(words.add("waiting for a camera"), "");
  EXPECT_EQ(words.add("[warning] slow port  \r"), "waiting for a camera");
  for (const char* line : {"Traceback (most recent call last):", "  File \"x.py\", line 1, in <module>", "    a()",
                           "OSError: first", "", "During handling of the above exception, another exception occurred:", "",
                           "Traceback (most recent call last):", "  File \"x.py\", line 3, in <module>", "RuntimeError: busy"})
    EXPECT_EQ(words.add(line), "") << line;
  EXPECT_EQ(words.reason(), "busy");
  EXPECT_EQ(words.take(), "[warning] slow port");
  EXPECT_EQ(words.take(), "");
}

TEST(BridgeWords, AMissingPackageIsTheLineThatInstallsIt) {
  const BridgeCommand command{"d435i", {}, "pyrealsense2 numpy"};
  for (const char* failure : {"ModuleNotFoundError: No module named 'pyrealsense2'", "ImportError: libusb-1.0.so.0: cannot open",
                              "AttributeError: module 'depthai' has no attribute 'CameraExposureOffset'"}) {
    BridgeWords words(command);
    words.add("Traceback (most recent call last):");
    words.add(failure);
    EXPECT_TRUE(words.reason().starts_with("`pip install pyrealsense2 numpy` (")) << words.reason();
    EXPECT_NE(words.reason().find(failure), std::string::npos);
  }
}

TEST(BridgeProcess, AFailureBeforeAnythingCameIsItsEnd) {
  Shell shell("echo 'no mode 1x1, but 640x480' >&2; exit 1");
  ASSERT_TRUE(soon([&] { return shell.ends == 1; }));
  EXPECT_TRUE(shell.process.is_over());
  ASSERT_FALSE(shell.process.end());
  EXPECT_EQ(shell.process.end().error().message, "oak: no mode 1x1, but 640x480");
}

TEST(BridgeProcess, AnEndWithoutDataIsAFailureAndOneWithDataIsNone) {
  Shell silent("exit 0"), sends("sleep 0.3; exit 0");
  sends.process.something_came();
  ASSERT_TRUE(soon([&] { return silent.ends == 1 && sends.ends == 1; }));
  EXPECT_EQ(silent.process.end().error().message, "oak: its program has ended (exit code 0)");
  EXPECT_TRUE(sends.process.end());
}

TEST(BridgeProcess, IsStartedAgainOnceItHasSent) {
  const std::string file = ::testing::TempDir() + "bridge_starts";
  std::filesystem::remove(file);
  Shell shell("echo . >> " + file + "; sleep 0.2; kill -9 $$");
  shell.process.something_came();
  const auto starts = [&] {
    std::ifstream lines(file);
    int n = 0;
    for (std::string line; std::getline(lines, line);) ++n;
    return n;
  };
  EXPECT_TRUE(soon([&] { return starts() >= 2; }));
  EXPECT_FALSE(shell.process.is_over());
  ASSERT_FALSE(shell.sentences().empty());
  EXPECT_EQ(shell.sentences().front(), "oak: its program has ended (signal 9); it is started again");
}

TEST(BridgeProcess, NothingStaysOfOneThatIgnoresTheSignal) {
  const std::string file = ::testing::TempDir() + "bridge_pid";
  pid_t pid = 0;
  {
    Shell shell("trap '' TERM; echo $$ > " + file + "; echo ready; while true; do sleep 0.1; done");
    ASSERT_TRUE(soon([&] { return !shell.sentences().empty(); }));
    EXPECT_EQ(shell.sentences().front(), "oak: ready");
    std::ifstream(file) >> pid;
    ASSERT_GT(pid, 1);
    ASSERT_EQ(kill(pid, 0), 0);
  }
  EXPECT_EQ(kill(pid, 0), -1);
}

TEST(BridgeProcess, AnInterpreterThatIsNotThereIsNamed) {
  BridgeProcess process(
      {"oak", {"/nowhere/python3"}, "depthai numpy"}, [](const std::string&) {}, [] {});
  ASSERT_TRUE(soon([&] { return process.is_over(); }));
  EXPECT_EQ(process.end().error().message,
            "oak: /nowhere/python3 cannot be started: install Python 3, or name it by FBVINS_PYTHON");
}

}  // namespace bridge_process_test
}  // namespace fbvins::app
