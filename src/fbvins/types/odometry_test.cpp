// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/odometry.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace odometry_test {

TEST(Health, IsASentenceThatNamesTheCameras) {
  EXPECT_EQ(to_sentence({HealthState::good, HealthReason::none}), "good");
  EXPECT_EQ(to_sentence({HealthState::lost, HealthReason::no_images}), "lost: no_images");
  EXPECT_EQ(to_sentence({HealthState::degraded, HealthReason::one_camera, 0b10}), "degraded: one_camera, without camera 1");
  EXPECT_EQ(to_sentence({HealthState::degraded, HealthReason::one_camera, 0b10000101}),
            "degraded: one_camera, without cameras 0 2 7");
  EXPECT_EQ(cameras_in(0), std::vector<int>{});
}

}  // namespace odometry_test
}  // namespace fbvins
