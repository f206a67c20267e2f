// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/scaled_lens.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace scaled_lens_test {

Camera camera() { return {PinholeRadtan{458.654, 457.296, 367.215, 248.375, -0.283, 0.074, 0.0002, 0.00002}, 752, 480}; }

/// The same point of the image, whose upper left corner is at (-0.5, -0.5).
Vec2 scaled(const Vec2& px, double factor) { return factor * (px + Vec2(0.5, 0.5)) - Vec2(0.5, 0.5); }

TEST(ScaledLens, SeesTheSameAtAnotherSize) {
  for (const double factor : {0.5, 2.0, 0.75}) {
    const auto other = scaled_to(camera(), static_cast<int>(752 * factor), static_cast<int>(480 * factor));
    ASSERT_TRUE(other) << factor;
    EXPECT_EQ(other->width(), 752 * factor);
    for (const Vec3& p : {Vec3(0.3, -0.2, 1), Vec3(-0.6, 0.4, 1), Vec3(0, 0, 3)})
      EXPECT_LT((*other->project(p) - scaled(*camera().project(p), factor)).norm(), 1e-9) << factor;
  }
  EXPECT_EQ(with_scaled_lens(camera(), 0.5).width(), 752);
  EXPECT_NEAR(with_scaled_lens(camera(), 0.5).focal_px(), 0.5 * camera().focal_px(), 1e-12);
}

TEST(ScaledLens, IsNoneOfAnImageOfAnotherShape) {
  EXPECT_FALSE(scaled_to(camera(), 640, 480)) << "cut off at its sides";
  EXPECT_FALSE(scaled_to(camera(), 480, 752));
  EXPECT_TRUE(scaled_to(camera(), 250, 160)) << "a third, rounded";
}

TEST(ScaledLens, TheMiddleSeesTheSame) {
  const auto cut = middle_of(camera(), 640, 400);
  ASSERT_TRUE(cut);
  const Vec3 p(0.3, -0.1, 2);
  EXPECT_LT((*cut->project(p) - (*camera().project(p) - Vec2(56, 40))).norm(), 1e-9);
  EXPECT_FALSE(middle_of(camera(), 752, 480)) << "all of it";
  EXPECT_FALSE(middle_of(camera(), 800, 480));
  EXPECT_FALSE(middle_of(camera(), 300, 480)) << "that would be another camera's";
  Camera masked = camera();
  Image seen(752, 480, 255);
  hide(seen, MaskRectangle{0, 440, 752, 40});
  masked.set_mask(std::make_shared<const Mask>(seen));
  EXPECT_FALSE(middle_of(masked, 640, 400)->hidden({100, 398}, 0));
  EXPECT_TRUE(middle_of(masked, 640, 440)->hidden({100, 421}, 0));
}

TEST(ScaledLens, TakesItsMaskAlong) {
  Camera masked = camera();
  Image seen(752, 480, 255);
  hide(seen, MaskRectangle{0, 240, 752, 240});
  masked.set_mask(std::make_shared<const Mask>(seen));
  const auto half = scaled_to(masked, 376, 240);
  ASSERT_TRUE(half && half->mask());
  EXPECT_NEAR(half->mask()->hidden_share(), 0.5, 1e-12);
  EXPECT_TRUE(half->hidden({100, 121}, 0));
  EXPECT_FALSE(half->hidden({100, 118}, 0));
}

}  // namespace scaled_lens_test
}  // namespace fbvins
