// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/survival.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace survival_test {

TrackedFrame frame_with(std::int64_t ms, const std::vector<std::int64_t>& ids) {
  TrackedFrame frame;
  frame.t = Time{ms * 1'000'000};
  for (const std::int64_t id : ids) {
    TrackedFeature feature;
    feature.id = TrackId{id};
    frame.features.push_back(feature);
  }
  return frame;
}

TEST(SurvivalMeter, ComparesWithASecondAgo) {
  SurvivalMeter meter;
  EXPECT_EQ(meter.add(frame_with(0, {4, 2, 9})).then, 0);
  EXPECT_EQ(meter.add(frame_with(500, {2, 3})).then, 0);
  const Survival first = meter.add(frame_with(1000, {9, 3, 4}));  // 2 was lost, 3 is new
  EXPECT_EQ(first.then, 3);
  EXPECT_EQ(first.now, 2);
  const Survival second = meter.add(frame_with(1500, {2, 3}));
  EXPECT_EQ(second.then, 2);
  EXPECT_EQ(second.now, 2);
  EXPECT_EQ(meter.add(frame_with(2000, {})).now, 0);
}

}  // namespace survival_test
}  // namespace fbvins
