// SPDX-License-Identifier: Apache-2.0
// Depth images of librealsense's software device.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "fbvins/realsense/realsense_camera.hpp"
#include "tests/support/collected_input.hpp"
#include "tests/support/realsense_test_device.hpp"

namespace fbvins {
namespace realsense_depth_test {

using namespace test;

/// In the place of the right images; values are tenths of a millimetre there, and the sensor's noise follows from the baseline.
TEST(RealsenseDepth, DepthImagesComeWithTheLeftOnes) {
  SoftwareCamera device(rig());
  CollectedInput got;
  auto camera = RealsenseCamera::open(device.device(), [](const std::string& s) { ADD_FAILURE() << s; }, {.depth = true});
  ASSERT_TRUE(camera) << camera.error().message;
  const StereoRig& seen = *(*camera)->rig();
  EXPECT_EQ(seen.camera_count(), 1);
  ASSERT_TRUE(seen.depth);
  EXPECT_FALSE(seen.depth->own) << "measured in the left camera's pixels";
  EXPECT_NEAR(seen.depth->noise_at_1m_m, 0.08 / (380.5 * 0.095), 1e-6);
  EXPECT_EQ(device.emitter(), 0);
  ASSERT_TRUE((*camera)->start(got, FrameJoiner(1, true)));
  for (int i = 0; i < 10; ++i) {
    const Time t = kStart + Duration{33 * i * kMs};
    DepthImage depth{640, 480, std::vector<std::uint16_t>(640 * 480, static_cast<std::uint16_t>(20000 + 10 * i))};
    depth.mm.back() = 0;
    device.depth(t, depth);
    device.image(0, t, Image(640, 480, static_cast<std::uint8_t>(i)));
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ASSERT_TRUE(got.wait_for_frames(10, kPatience));
  (*camera)->stop();
  ASSERT_EQ(got.frames.size(), 10u);
  for (std::size_t i = 0; i < 10; ++i) {
    const StereoFrame& frame = got.frames[i];
    ASSERT_TRUE(frame.left() && frame.depth) << i;
    EXPECT_FALSE(frame.right());
    EXPECT_EQ(frame.left()->at(5, 5), i);
    EXPECT_EQ(frame.depth->row(479)[638], 2000 + i);
    EXPECT_EQ(frame.depth->row(479)[639], 0);
  }
}

TEST(RealsenseDepth, ADepthStreamThatLiesElsewhereHasItsOwnLensAndPose) {
  StereoRig apart = with_depth(with_one_camera(rig()), {});
  apart.cameras.push_back(rig().mounted(1));  // the device's, which is not used
  const Pose<C0, C0> T_CD(so3_exp(Vec3(0.01, -0.02, 0.03)), Vec3(0.015, 0.001, -0.002));
  apart.depth->own = MountedCamera{Camera(PinholeRadtan{425, 425, 424, 240, 0, 0, 0, 0}, 848, 480), apart.T_BC0() * T_CD};
  SoftwareCamera device(apart);
  const auto camera = RealsenseCamera::open(device.device(), [](const std::string&) {}, {.depth = true});
  ASSERT_TRUE(camera) << camera.error().message;
  ASSERT_TRUE((*camera)->rig()) << (*camera)->rig().error().message;
  const auto& own = (*camera)->rig()->depth->own;
  ASSERT_TRUE(own);
  EXPECT_EQ(own->camera.width(), 848);
  EXPECT_LT((own->T_BC.p - apart.depth->own->T_BC.p).norm(), 1e-6);
  EXPECT_LT(own->T_BC.q.angularDistance(apart.depth->own->T_BC.q), 1e-3);
}

}  // namespace realsense_depth_test
}  // namespace fbvins
