// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/tracking.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace tracking_test {

Observation at(double x_px) { return {.pixel = Vec2(x_px, 0)}; }

TEST(TrackedFeature, IsSeenByAnyCamerasItsLeadFirst) {
  TrackedFeature f;
  f.lead = 2;
  for (const int camera : {1, 0, 2, 5}) f.see(camera, at(10 * camera));
  ASSERT_EQ(f.seen.size(), 4u);
  EXPECT_EQ(f.seen.front().camera, 2);
  for (const int camera : {0, 1, 2, 5}) EXPECT_EQ(f.by(camera)->pixel.x(), 10 * camera);
  EXPECT_EQ(f.by(3), nullptr);
  EXPECT_EQ(f.left(), f.by(0));
  EXPECT_EQ(f.right(), f.by(1));
  EXPECT_TRUE(f.by_several());
}

TEST(TrackedFeature, IsSeenOnceByACamera) {
  TrackedFeature f;
  f.see(0, at(1));
  f.see(1, at(2));
  f.see(0, at(3));
  ASSERT_EQ(f.seen.size(), 2u);
  EXPECT_EQ(f.seen.front().pixel.x(), 3);
  f.see(1, std::optional<Observation>());
  EXPECT_EQ(f.right()->pixel.x(), 2) << "nothing changes nothing";
  f.forget(0);
  EXPECT_EQ(f.left(), nullptr);
  EXPECT_FALSE(f.by_several());
}

}  // namespace tracking_test
}  // namespace fbvins
