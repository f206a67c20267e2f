// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/camera_times.hpp"

#include <gtest/gtest.h>

#include "fbvins/camera/camera_groups.hpp"
#include "fbvins/camera/check_rig.hpp"
#include "fbvins/camera/scaled_lens.hpp"
#include "fbvins/camera/virtual_pinholes.hpp"

namespace fbvins {
namespace camera_times_test {

Camera lens() { return Camera(PinholeRadtan{.fx = 400, .fy = 400, .cx = 319.5, .cy = 239.5}, 640, 480); }

StereoRig rig_of(int cameras) {
  std::vector<MountedCamera> mounted;
  for (int i = 0; i < cameras; ++i) mounted.push_back({lens(), Pose<B, C0>(Quat::Identity(), Vec3(0.1 * i, 0, 0))});
  return with_cameras({}, mounted);
}

TEST(CameraTimes, EqualOnesAreTheRigsAndNoCameraHasItsOwn) {
  const StereoRig rig = with_times(rig_of(3), std::vector<CameraTimes>(3, {0.0041, 3.1e-5}));
  EXPECT_EQ(rig.time_offset_s, 0.0041);
  EXPECT_EQ(rig.line_delay_s, 3.1e-5);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(rig.camera(i).own_times(), CameraTimes{}) << i;
    EXPECT_EQ(rig.times(i), (CameraTimes{0.0041, 3.1e-5})) << i;
  }
  EXPECT_EQ(own_offsets(rig), ExposureOffsets{});
}

TEST(CameraTimes, OwnOnesAddToTheRigs) {
  StereoRig rig = with_times(rig_of(3), {{0.004, 0}, {0.009, 4e-5}, {0.001, 2e-5}});
  EXPECT_TRUE(check_rig(rig, "rig"));
  EXPECT_TRUE(has_rolling_shutter(rig));
  EXPECT_EQ(own_offsets(rig), ExposureOffsets({{}, Duration{5'000'000}, Duration{-3'000'000}}));
  rig.time_offset_s += 0.01;  // what is common to all is corrected there
  for (const auto& [i, offset_s] : {std::pair(0, 0.014), {1, 0.019}, {2, 0.011}})
    EXPECT_DOUBLE_EQ(rig.times(i).time_offset_s, offset_s) << i;
  EXPECT_DOUBLE_EQ(rig.times(1).line_delay_s, 4e-5);
}

/// Whichever cameras are left, each keeps its times, and the first one's are the rig's.
TEST(CameraTimes, StayWithTheirCameras) {
  const StereoRig rig = with_times(rig_of(4), {{0.004, 0}, {0.009, 4e-5}, {0.001, 2e-5}, {0.003, 0}});
  const StereoRig right = with_one_camera(rig, true);
  EXPECT_DOUBLE_EQ(right.time_offset_s, 0.009);
  EXPECT_DOUBLE_EQ(right.line_delay_s, 4e-5);
  EXPECT_EQ(right.left().own_times(), CameraTimes{});
  const StereoRig pair = fbvins::rig_of(rig, {2, 3});
  EXPECT_DOUBLE_EQ(pair.time_offset_s, 0.001);
  EXPECT_DOUBLE_EQ(pair.times(1).time_offset_s, 0.003);
  EXPECT_NEAR(pair.times(1).line_delay_s, 0, 1e-18);
  EXPECT_EQ(own_offsets(pair), ExposureOffsets({{}, Duration{2'000'000}}));
  EXPECT_EQ(scaled_to(rig.right(), 320, 240)->own_times(), rig.right().own_times());
  EXPECT_EQ(rig.right().with_lens(PinholeRadtan{}).own_times(), rig.right().own_times());
}

TEST(CameraTimes, FacesOfAWideLensHaveThoseOfTheLens) {
  StereoRig rig = rig_of(2);
  rig.cameras[1].camera =
      Camera(KannalaBrandt{.fx = 180, .fy = 180, .cx = 319.5, .cy = 319.5, .k1 = 0, .k2 = 0, .k3 = 0, .k4 = 0}, 640, 640);
  ASSERT_TRUE(rig.right().sees_backwards());
  rig = with_times(rig, {{0, 0}, {0.002, 1e-5}});
  const VirtualPinholes faces(rig);
  for (int i = 0; i < faces.rig().camera_count(); ++i) EXPECT_EQ(faces.rig().times(i), rig.times(faces.lens_of(i))) << i;
}

TEST(CameraTimes, ThoseThatCannotBeAreRefused) {
  EXPECT_EQ(check_rig(with_times(rig_of(2), {{0, 0}, {0, 4e-2}}), "rig").error().message,
            "rig: the line delay of camera 1 is 0.04 s, more than 0.001 s a row");
  EXPECT_EQ(check_rig(with_times(rig_of(2), {{0.02, 0}, {-0.2, 0}}), "rig").error().message,
            "rig: the time offset of camera 1 differs from camera 0's by -220.0 ms, more than 100 ms");
}

}  // namespace camera_times_test
}  // namespace fbvins
