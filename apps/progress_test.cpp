// SPDX-License-Identifier: Apache-2.0
#include "apps/progress.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace fbvins::app {
namespace progress_test {

/// What is told of `total` steps, one after the other.
std::string told(int total, bool quiet) {
  testing::internal::CaptureStderr();
  {
    Progress progress(total, quiet);
    for (int done = 1; done <= total; ++done) progress.update(done);
    progress.update(total + 5);
  }
  return testing::internal::GetCapturedStderr();
}

TEST(Progress, ElsewhereThanOnATerminalItTellsEveryTenth) {
  const std::string text = told(200, false);
  EXPECT_EQ(std::ranges::count(text, '\n'), 10);
  EXPECT_EQ(text.find(" 10 %  20/200 frames"), 0u);
  EXPECT_NE(text.find("100 %  200/200 frames"), std::string::npos);
  EXPECT_EQ(text.find('\r'), std::string::npos);
}

TEST(Progress, QuietIsQuiet) { EXPECT_EQ(told(200, true), ""); }

TEST(ProgressBar, SaysWhatIsLeftOnceSomethingIsDone) {
  const ProgressBar bar(true);
  EXPECT_EQ(bar.left(0, 1), "");
  EXPECT_EQ(bar.left(1, 0), "");
  EXPECT_EQ(bar.left(1e6, 1), "0 s left");
  const double hours_of_now = 7300 / std::max(1e-9, bar.elapsed_s());
  EXPECT_NE(bar.left(1, hours_of_now).find(" h left"), std::string::npos) << "the clock goes on meanwhile: more than two hours";
}

}  // namespace progress_test
}  // namespace fbvins::app
