// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/recent_motion.hpp"

#include <gtest/gtest.h>

#include "tests/support/test_room.hpp"

namespace fbvins {
namespace recent_motion_test {

using namespace test_room;

Time at_s(double s) { return Time{} + Duration::from_seconds(s); }

/// A keyframe of the rounds in the room, with the readings since `before_s`; its velocity is wrong by a little.
Keyframe flown(double s, double before_s) {
  Keyframe k = keyframe(FrameId{0}, at_s(s), true_pose(s));
  k.gauge.v_GB = true_velocity(s) + Vec3(0.02, -0.01, 0.01);
  if (before_s < s) k.imu.segments = {readings(at_s(before_s), at_s(s), {})};
  return k;
}

TEST(RecentMotion, IsKnownBetweenKeyframesToMillimetres) {
  RecentMotion motion;
  motion.add(flown(2, 2));
  motion.add(flown(2.5, 2));
  motion.add(flown(3.1, 2.5));
  for (const double s : {2.0, 2.013, 2.3, 2.5, 2.777, 3.1}) {
    const auto T = motion.at(at_s(s));
    ASSERT_TRUE(T) << s;
    EXPECT_LT((T->p - true_pose(s).p).norm(), 0.003) << s;
    EXPECT_LT(so3_log(T->q.conjugate() * true_pose(s).q).norm(), 0.002) << s;
  }
}

TEST(RecentMotion, IsNotKnownBeforeAfterAndWithoutReadings) {
  RecentMotion motion;
  EXPECT_FALSE(motion.at(at_s(2)));
  motion.add(flown(2, 2));
  motion.add(flown(2.5, 2.5));
  motion.add(flown(3, 2.5));
  EXPECT_FALSE(motion.at(at_s(1.9)));
  EXPECT_FALSE(motion.at(at_s(2.2)));
  EXPECT_TRUE(motion.at(at_s(2.5)));
  EXPECT_TRUE(motion.at(at_s(2.7)));
  EXPECT_FALSE(motion.at(at_s(3.01)));
}

TEST(RecentMotion, ForgetsWhatIsOld) {
  RecentMotion motion;
  motion.add(flown(0, 0));
  for (double s = 0.5; s < 12; s += 0.5) motion.add(flown(s, s - 0.5));
  EXPECT_FALSE(motion.at(at_s(3)));
  EXPECT_TRUE(motion.at(at_s(8.2)));
}

}  // namespace recent_motion_test
}  // namespace fbvins
