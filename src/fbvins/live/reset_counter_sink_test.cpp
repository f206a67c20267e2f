// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/reset_counter_sink.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace fbvins {
namespace reset_counter_sink_test {

class ResetCounter : public ::testing::Test {
 protected:
  ~ResetCounter() override { std::filesystem::remove(file_); }

  static LivePose pose(std::uint32_t counter) {
    LivePose p;
    p.reset_counter = counter;
    return p;
  }
  const std::string file_ = ::testing::TempDir() + "/fbvins_reset_counter_" + std::to_string(getpid());
};

TEST_F(ResetCounter, EachProcessBeginsWithTheNextOne) {
  for (const std::uint32_t expected : {0u, 1u, 2u}) EXPECT_EQ(ResetCounterSink(file_).first(), expected);
}

TEST_F(ResetCounter, RestartsOfTheEstimatorCount) {
  {
    ResetCounterSink sink(file_);
    for (const std::uint32_t counter : {0u, 0u, 1u, 1u, 2u}) ASSERT_TRUE(sink.take(pose(counter)));
  }
  EXPECT_EQ(ResetCounterSink(file_).first(), 3u) << "the process that ended had published 2";
}

TEST_F(ResetCounter, JumpsOfMCountAsMavlinkCountsThem) {
  {
    ResetCounterSink sink(file_);
    MapUpdate update;
    update.localised = update.found = true;
    ASSERT_TRUE(sink.take(update));
    ASSERT_TRUE(sink.take(pose(0)));
  }
  EXPECT_EQ(ResetCounterSink(file_).first(), 2u) << "poses in M had 1";
}

TEST_F(ResetCounter, StaysWithinTheEightBitsOfMavlink) {
  std::ofstream(file_) << "255\n";
  EXPECT_EQ(ResetCounterSink(file_).first(), 0u);
}

TEST_F(ResetCounter, ADamagedFileIsReplaced) {
  for (const char* text : {"", "12", "many\n", "-3\n", "99999999999\n"}) {
    std::ofstream(file_) << text;
    const ResetCounterSink damaged(file_);
    EXPECT_TRUE(damaged.was_unreadable()) << text;
    EXPECT_EQ(damaged.first(), 128u) << text;
    const ResetCounterSink next(file_);
    EXPECT_FALSE(next.was_unreadable()) << text;
    EXPECT_EQ(next.first(), 129u) << text;
  }
}

TEST_F(ResetCounter, AFileThatCannotBeWrittenIsSaidOnceAndPosesGoOn) {
  ResetCounterSink sink(file_, [](const std::string&, std::string_view) -> Result<void> {
    return Error{ErrorCode::unwritable, "read-only"};
  });
  EXPECT_EQ(sink.take(pose(0)).error().message, "read-only");
  EXPECT_TRUE(sink.take(pose(0)));
}

}  // namespace reset_counter_sink_test
}  // namespace fbvins
