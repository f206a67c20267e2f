// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/signing_time.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

namespace fbvins {
namespace signing_time_test {

std::string file_named(const std::string& name) {
  const std::string file = testing::TempDir() + name;
  std::filesystem::remove(file);
  return file;
}

TEST(SigningTime, GrowsOverRestartsWhateverTheComputersClockSays) {
  const std::string file = file_named("fbvins_signing_time");
  std::uint64_t newest = 1000;
  for (int start = 0; start < 5; ++start) {
    SigningTime time(file);
    EXPECT_TRUE(start == 0 || time.first() > newest);
    newest = std::max(newest, time.first());
    for (int second = 0; second < 20; ++second) {
      EXPECT_TRUE(time.keep(newest += 100'000));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
}

TEST(SigningTime, WritesAboutTwiceAMinuteAndWaitsForNoDisk) {
  std::atomic<int> writes = 0;
  std::atomic<bool> disk_hangs = true;
  SigningTime time(file_named("fbvins_signing_time_rate"), [&](const std::string&, std::string_view) {
    ++writes;
    while (disk_hangs) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return Result<void>{};
  });
  for (std::uint64_t second = 0; second < 25; ++second) EXPECT_TRUE(time.keep(second * 100'000));
  disk_hangs = false;
  for (std::uint64_t second = 25; second < 600; ++second) {
    EXPECT_TRUE(time.keep(second * 100'000));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_LE(writes, 21);
  EXPECT_GE(writes, 2);
}

TEST(SigningTime, ADamagedFileCountsAsNone) {
  const std::string file = file_named("fbvins_signing_time_bad");
  for (const char* text : {"", "no number", "-5", "999999999999999999999999", "18446744073709551615"}) {
    std::ofstream(file) << text;
    EXPECT_EQ(SigningTime(file).first(), 0u) << text;
  }
}

TEST(SigningTime, SaysWhenItCannotBeKept) {
  SigningTime time("/proc/no/such/place");
  bool kept = true;
  for (int i = 0; kept && i < 5000; ++i) {
    kept = time.keep(5);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_FALSE(kept);
}

}  // namespace signing_time_test
}  // namespace fbvins
