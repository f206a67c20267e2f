// SPDX-License-Identifier: Apache-2.0
// A textured wall parallel to the images: every feature of it lies at one depth.
#include "fbvins/loop/place_extractor.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/noise_texture.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace place_extractor_test {

constexpr double kDepth_m = 3;

std::shared_ptr<const Image> wall(double shift_px) {
  static const NoiseTexture texture(3);
  return std::make_shared<Image>(render_texture(
      752, 480, texture, [&](const Vec2& p) { return Vec2(p + Vec2(shift_px, 0)); }, 128, 40));
}

StereoFrame before_the_wall() {
  StereoFrame frame;
  frame.set_image(0, wall(0));
  frame.set_image(1, wall(test_room::kFocal * test_room::kBaseline / kDepth_m));
  return frame;
}

PlaceExtractor extractor(int max_features = 200) {
  return PlaceExtractor(test_room::rig(), {.max_features = max_features}, test_room::vocabulary());
}

TEST(PlaceExtractor, FindsTheDepthOfAWall) {
  const Place place = extractor().extract(before_the_wall(), Mat3::Identity());
  ASSERT_GT(place.size(), 100u);
  EXPECT_LE(place.size(), 200u);
  EXPECT_EQ(place.descriptors.size(), place.size());
  EXPECT_FALSE(place.words.empty());
  EXPECT_NEAR(place.focal_px, test_room::kFocal, 1e-9);
  int with_depth = 0, right = 0;
  for (const PlaceFeature& f : place.features) {
    with_depth += f.has_depth();
    right += f.has_depth() && std::abs(f.inverse_depth - 1 / kDepth_m) < 3 * f.sigma_inverse_depth;
  }
  EXPECT_GT(with_depth, static_cast<int>(place.size()) / 2);
  EXPECT_GT(right, 0.95 * with_depth);
}

TEST(PlaceExtractor, TakesTheVerticalFromTheAttitude) {
  const Quat R_LB = so3_exp(Vec3(0.3, -0.2, 1.0));
  const Place place = extractor().extract({}, R_LB.toRotationMatrix());
  EXPECT_LT((R_LB * (test_room::rig().T_BC0().q * place.up_C0) - Vec3::UnitZ()).norm(), 1e-12);
}

TEST(PlaceExtractor, WithoutTheRightImageThereIsNoDepthWithoutTheLeftOneNothing) {
  StereoFrame frame = before_the_wall();
  frame.set_image(1, nullptr);
  const Place place = extractor().extract(frame, Mat3::Identity());
  EXPECT_GT(place.size(), 100u);
  EXPECT_TRUE(std::none_of(place.features.begin(), place.features.end(), [](const PlaceFeature& f) { return f.has_depth(); }));
  EXPECT_EQ(extractor().extract({}, Mat3::Identity()).size(), 0u);
}

/// The right camera took its image 25 ms before the left one, in a flight to the left: the baseline is 5 cm longer.
TEST(PlaceExtractor, CamerasWithoutACommonTriggerHaveTheBaselineOfTheirExposures) {
  Keyframe keyframe;
  keyframe.t = Time{1'000'000'000};
  keyframe.v_WB = Vec3(0, 2, 0);
  keyframe.images.set_image(0, wall(0));
  keyframe.images.set_image(1, wall(test_room::kFocal * (test_room::kBaseline + 0.05) / kDepth_m));
  keyframe.images.offsets.set(1, Duration{-25'000'000});
  const auto with_depth = [&] {
    int right = 0, wrong = 0;
    for (const PlaceFeature& f : extractor().extract(keyframe).features) {
      if (!f.has_depth()) continue;
      (std::abs(f.inverse_depth - 1 / kDepth_m) < 3 * f.sigma_inverse_depth ? right : wrong)++;
    }
    return std::pair(right, wrong);
  };
  EXPECT_EQ(with_depth(), std::pair(0, 0)) << "without readings it is not known where they were";
  ImuSegment readings;
  for (int i = -10; i <= 0; ++i)
    readings.samples.push_back({keyframe.t + Duration{i * 5'000'000}, Vec3::Zero(), Vec3(0, 0, 9.81)});
  keyframe.imu.segments = {readings};
  const auto [right, wrong] = with_depth();
  EXPECT_GT(right, 80);
  EXPECT_LT(wrong, right / 20);
}

TEST(PlaceExtractor, TakesDepthsFromTheDepthImage) {
  const StereoRig rig = with_depth(test_room::rig(), {.noise_at_1m_m = 0.004});
  PlaceExtractor extractor(rig, {.max_features = 200}, test_room::vocabulary());
  StereoFrame frame;
  frame.set_image(0, wall(0));
  auto depth = std::make_shared<DepthImage>(DepthImage{752, 480, std::vector<std::uint16_t>(752 * 480, 3000)});
  std::fill_n(depth->mm.begin(), 752 * 240, std::uint16_t{0});  // of the lower half alone
  frame.depth = depth;
  int with_depth = 0, without = 0;
  for (const PlaceFeature& f : extractor.extract(frame, Mat3::Identity()).features) {
    const double row = 240 + test_room::kFocal * f.y;
    EXPECT_FALSE(row < 237 && f.has_depth());
    if (row < 243) continue;
    with_depth += f.has_depth(), without += !f.has_depth();
    if (!f.has_depth()) continue;
    EXPECT_NEAR(f.inverse_depth, 1.0 / 3, 1e-4);
    EXPECT_NEAR(f.sigma_inverse_depth, 0.004, 1e-4);
  }
  EXPECT_GT(with_depth, 30);
  EXPECT_LT(without, with_depth / 4);  // at the edges
}

TEST(PlaceExtractor, APlaceHasNoFeatureInTheMask) {
  StereoRig rig = test_room::rig();
  Image left(752, 480, 255), right(752, 480, 255);
  hide(left, MaskRectangle{0, 300, 752, 180});
  hide(right, MaskRectangle{300, 0, 100, 480});
  rig.cameras[0].camera.set_mask(std::make_shared<const Mask>(left));
  rig.cameras[1].camera.set_mask(std::make_shared<const Mask>(right));
  const Place place =
      PlaceExtractor(rig, {.max_features = 200}, test_room::vocabulary()).extract(before_the_wall(), Mat3::Identity());
  ASSERT_GT(place.size(), 100u);
  const double disparity_px = test_room::kFocal * test_room::kBaseline / kDepth_m;
  for (const PlaceFeature& feature : place.features) {
    const Vec2 px = rig.left().distort(Vec2(feature.x, feature.y));
    EXPECT_FALSE(rig.left().hidden(px, kPatchBorder_px));
    const bool on_wall = feature.has_depth() && std::abs(feature.inverse_depth - 1 / kDepth_m) < 0.01;
    EXPECT_FALSE(on_wall && rig.right().hidden(px - Vec2(disparity_px, 0), kPatchBorder_px - 1));
  }
}

TEST(PlaceExtractor, SameImagesSameBits) {
  PlaceExtractor used = extractor(), fresh = extractor();
  const StereoFrame frame = before_the_wall();
  (void)used.extract(frame, Mat3::Identity());
  EXPECT_EQ(used.extract(frame, Mat3::Identity()).features, fresh.extract(frame, Mat3::Identity()).features);
}

}  // namespace place_extractor_test
}  // namespace fbvins
