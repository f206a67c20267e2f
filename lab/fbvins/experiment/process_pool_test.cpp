// SPDX-License-Identifier: Apache-2.0
#include "fbvins/experiment/process_pool.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <map>

#include "fbvins/io/file_source.hpp"

namespace fbvins {
namespace process_pool_test {

std::string log_file() { return ::testing::TempDir() + "/fbvins_process_pool_" + std::to_string(getpid()); }

TEST(ProcessPool, ReportsWhichProgramEndedAndHow) {
  ProcessPool pool;
  const std::map<int, std::string> programs{{1, "exit 0"}, {2, "exit 7"}, {3, "kill -9 $$"}};
  for (const auto& [tag, script] : programs) ASSERT_TRUE(pool.start(tag, {"/bin/sh", "-c", script}, "/dev/null"));
  EXPECT_EQ(pool.running(), 3);
  std::map<int, int> codes;
  while (pool.running() > 0) {
    const ProcessPool::Ended ended = pool.wait();
    codes[ended.tag] = ended.exit_code;
  }
  EXPECT_EQ(codes, (std::map<int, int>{{1, 0}, {2, 7}, {3, 128 + 9}}));
}

TEST(ProcessPool, BothStreamsGoToTheLogAndArgumentsAreUnchanged) {
  ProcessPool pool;
  ASSERT_TRUE(pool.start(1, {"/bin/sh", "-c", "echo \"$1\"; echo bad >&2", "sh", "a b *"}, log_file()));
  EXPECT_EQ(pool.wait().exit_code, 0);
  EXPECT_EQ(*read_file(log_file(), 100), "a b *\nbad\n");
}

TEST(ProcessPool, AMissingProgramGivesAnExitCode) {
  ProcessPool pool;
  ASSERT_TRUE(pool.start(1, {"/nowhere/program"}, "/dev/null"));
  EXPECT_EQ(pool.wait().exit_code, 127);
  EXPECT_FALSE(pool.start(2, {"/bin/true"}, "/nowhere/log"));
  EXPECT_EQ(pool.running(), 0);
}

TEST(ProcessPool, TheDestructorTerminatesRunningPrograms) {
  const auto begin = std::chrono::steady_clock::now();
  {
    ProcessPool pool;
    ASSERT_TRUE(pool.start(1, {"/bin/sleep", "300"}, "/dev/null"));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(60));
}

}  // namespace process_pool_test
}  // namespace fbvins
