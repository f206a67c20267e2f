// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/feedback.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace fbvins {
namespace feedback_test {

StatePrior state_after(std::int64_t frame) {
  StatePrior prior;
  prior.t = Time{frame};
  prior.valid = true;
  return prior;
}

LandmarkUpdate update(std::int64_t sequence) { return {sequence, 0, {{TrackId{100 + sequence}, Vec3::Zero()}}}; }

TEST(Feedback, AFrameSeesTheStateTwoFramesBefore) {
  Feedback feedback;
  EXPECT_FALSE(feedback.for_frame(FrameId{0}).prior.valid);
  EXPECT_FALSE(feedback.for_frame(FrameId{1}).prior.valid);
  feedback.publish(FrameId{0}, state_after(0), update(0));
  for (std::int64_t k = 1; k < 20; ++k) {
    feedback.publish(FrameId{k}, state_after(k), update(k));  // the estimator may be ahead by one more
    EXPECT_EQ(feedback.for_frame(FrameId{k + 1}).prior.t.ns, k - 1);
    EXPECT_EQ(feedback.for_frame(FrameId{k + 2}).prior.t.ns, k);
  }
}

TEST(Feedback, EveryLandmarkUpdateComesOnceAndInOrderHoweverManyFramesAreSkipped) {
  Feedback feedback;
  std::vector<std::int64_t> got;
  for (std::int64_t k = 0; k < 12; ++k) {
    feedback.publish(FrameId{k}, state_after(k), update(k));
    if (k % 5 != 4) continue;  // four frames of five never reach the frontend
    for (const LandmarkUpdate& u : feedback.for_frame(FrameId{k + 2}).landmarks) got.push_back(u.sequence);
  }
  for (const LandmarkUpdate& u : feedback.for_frame(FrameId{13}).landmarks) got.push_back(u.sequence);
  std::vector<std::int64_t> all(12);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::int64_t>(i);
  EXPECT_EQ(got, all);
}

TEST(Feedback, StoppingEndsAWait) {
  Feedback feedback;
  std::thread waiting([&] { EXPECT_FALSE(feedback.for_frame(FrameId{7}).prior.valid); });
  feedback.stop();
  waiting.join();
  (void)feedback.time_offset_for(FrameId{9});  // and later ones
}

}  // namespace feedback_test
}  // namespace fbvins
