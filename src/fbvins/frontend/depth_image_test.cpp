// SPDX-License-Identifier: Apache-2.0
// Frontends of a rig of one camera and a depth sensor.
#include <gtest/gtest.h>

#include <algorithm>

#include "fbvins/camera/depth_reader.hpp"
#include "fbvins/frontend/frontend_options.hpp"
#include "tests/support/test_wall.hpp"

namespace fbvins {
namespace depth_image_test {

StereoRig rig() { return with_depth(TestWall{}.rig(), {.noise_at_1m_m = 0.003}); }

/// Of the wall; nothing left of the column `from`.
std::shared_ptr<const DepthImage> depth_from(int from) {
  auto depth = std::make_shared<DepthImage>(DepthImage{TestWall::kWidth, TestWall::kHeight, {}});
  for (int y = 0; y < TestWall::kHeight; ++y)
    for (int x = 0; x < TestWall::kWidth; ++x) depth->mm.push_back(x < from ? 0 : 1000 * TestWall::kDepth_m);
  return depth;
}

SensorPacket packet(int k, std::shared_ptr<const DepthImage> depth) {
  static const TestWall wall;
  SensorPacket p;
  p.id = FrameId{k};
  p.frame.t = Time{50'000'000LL * k};
  p.frame.set_image(0, wall.render(0.01 * k, static_cast<std::uint64_t>(k)));
  p.frame.depth = std::move(depth);
  for (int i = 0; k > 0 && i <= 10; ++i)
    p.imu.samples.push_back({Time{p.frame.t.ns - 50'000'000 + 5'000'000 * i}, Vec3::Zero(), Vec3(0, 0, 9.81)});
  return p;
}

class DepthImageIn : public testing::TestWithParam<const char*> {
 protected:
  DepthImageIn() : frontend_(*make_frontend(rig(), GetParam())) {}
  std::unique_ptr<Frontend> frontend_;
};

TEST_P(DepthImageIn, EachFeatureOnItHasADepth) {
  for (int k = 0; k < 6; ++k) {
    const TrackedFrame frame = frontend_->process(packet(k, depth_from(120)), {});
    EXPECT_TRUE(frame.has(0) && frame.has(1));
    int with_depth = 0, beside = 0;
    for (const TrackedFeature& f : frame.features) {
      ASSERT_TRUE(f.left());
      const double x_px = f.left()->pixel.x();
      if (x_px < 117) beside += f.by_several();
      if (!f.right()) continue;
      ++with_depth;
      EXPECT_NEAR(f.left()->normalised.x() - f.right()->normalised.x(), kDepthBaseline_m / TestWall::kDepth_m, 1e-6);
      const Mat2& information = f.right()->sqrt_information;
      EXPECT_NEAR(1 / (kDepthBaseline_m * information(0, 0)), 0.003, 0.0005);
      EXPECT_TRUE(information(1, 1) == 0 && information(0, 1) == 0 && information(1, 0) == 0);
    }
    EXPECT_EQ(beside, 0);
    EXPECT_GT(with_depth, 15);
    EXPECT_EQ(frame.stats.stereo, with_depth);
  }
}

TEST_P(DepthImageIn, WithoutItTracksGoOn) {
  for (int k = 0; k < 3; ++k) (void)frontend_->process(packet(k, depth_from(0)), {});
  DepthImage other_size{10, 10, std::vector<std::uint16_t>(100, 3000)};
  for (const auto& none : {std::shared_ptr<const DepthImage>(), std::make_shared<const DepthImage>(other_size)}) {
    const TrackedFrame frame = frontend_->process(packet(none ? 4 : 3, none), {});
    EXPECT_TRUE(frame.has(0));
    EXPECT_FALSE(frame.has(1));
    EXPECT_GT(frame.stats.tracked, 30);
    EXPECT_TRUE(std::ranges::none_of(frame.features, &TrackedFeature::by_several));
  }
}

INSTANTIATE_TEST_SUITE_P(All, DepthImageIn, testing::Values("klt", "orb", "boost"));

}  // namespace depth_image_test
}  // namespace fbvins
