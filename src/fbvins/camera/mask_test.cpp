// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/mask.hpp"

#include <gtest/gtest.h>

#include "fbvins/camera/check_rig.hpp"
#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace mask_test {

Mask mask_of(int width, int height, const MaskRectangle& hidden) {
  Image seen(width, height, 255);
  EXPECT_TRUE(hide(seen, hidden));
  return Mask(seen);
}

TEST(Mask, HidesWholePixelsOfARectangle) {
  const Mask mask = mask_of(40, 30, {10, 5, 4, 3});
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) EXPECT_EQ(mask.hides(Vec2(x, y)), x >= 10 && x < 14 && y >= 5 && y < 8) << x << " " << y;
  EXPECT_DOUBLE_EQ(mask.hidden_share(), 12.0 / 1200);
  EXPECT_TRUE(mask.hides(Vec2(9.6, 5)));  // the pixel in which it lies
  EXPECT_FALSE(mask.hides(Vec2(9.4, 5)));
}

TEST(Mask, HidesPixelsWhoseCentresAreInACircle) {
  Image seen(40, 30, 255);
  EXPECT_TRUE(hide(seen, MaskCircle{38, 15, 5}));
  const Mask mask(seen);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) EXPECT_EQ(mask.hides(Vec2(x, y)), std::hypot(x - 38, y - 15) <= 5);
}

TEST(Mask, AShapeOutsideOfTheImageHidesNothing) {
  Image seen(40, 30, 255);
  EXPECT_FALSE(hide(seen, MaskRectangle{40, 0, 10, 10}));
  EXPECT_FALSE(hide(seen, MaskRectangle{1e300, 0, 1e300, 1}));
  EXPECT_FALSE(hide(seen, MaskRectangle{0, -5, 10, 5}));
  EXPECT_FALSE(hide(seen, MaskCircle{-3, -3, 3}));
  EXPECT_EQ(Mask(seen).hidden_share(), 0);
  EXPECT_TRUE(hide(seen, MaskRectangle{-1e9, 29, 2e9, 1e9}));  // what lies in the image counts
  EXPECT_DOUBLE_EQ(Mask(seen).hidden_share(), 1.0 / 30);
}

TEST(Mask, AMarginIsThatOfASquarePatch) {
  const Mask mask = mask_of(60, 50, {30, 20, 1, 1});
  for (int margin = 0; margin < 12; ++margin)
    for (int y = 0; y < 50; ++y)
      for (int x = 0; x < 60; ++x)
        EXPECT_EQ(mask.hides(Vec2(x, y), margin), std::max(std::abs(x - 30), std::abs(y - 20)) <= margin);
}

TEST(Mask, TheMarginIsToTheNearestOfManyPixels) {
  Rng rng(3);
  Image seen(64, 48, 255);
  std::vector<Vec2> hidden;
  for (int i = 0; i < 12; ++i) {
    const auto x = static_cast<int>(rng.below(64)), y = static_cast<int>(rng.below(48));
    seen.at(x, y) = 0;
    hidden.emplace_back(x, y);
  }
  const Mask mask(seen);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      double nearest = 1e9;
      for (const Vec2& h : hidden) nearest = std::min(nearest, (h - Vec2(x, y)).cwiseAbs().maxCoeff());
      EXPECT_TRUE(mask.hides(Vec2(x, y), nearest));
      EXPECT_FALSE(mask.hides(Vec2(x, y), nearest - 0.5));
    }
}

TEST(Mask, OutsideOfTheImageNothingIsHidden) {
  const Mask mask = mask_of(40, 30, {0, 0, 40, 5});
  for (const Vec2& px : {Vec2(-1, 0), Vec2(40, 0), Vec2(3, -0.6), Vec2(NAN, 2), Vec2(2, INFINITY)})
    EXPECT_FALSE(mask.hides(px, 3));
}

TEST(Mask, KnowsCellsOfWhichNothingIsLeft) {
  const Mask mask = mask_of(40, 30, {0, 0, 20, 10});
  EXPECT_TRUE(mask.hides_all(0, 0, 20, 10));
  EXPECT_FALSE(mask.hides_all(0, 0, 21, 10));
  EXPECT_TRUE(mask.hides_all(0, 0, 23, 13, 3));
  EXPECT_FALSE(mask.hides_all(0, 0, 24, 13, 3));
  EXPECT_TRUE(mask.hides_all(-5, -5, 20, 10));
  EXPECT_TRUE(mask.hides_all(0, 30, 40, 60));  // an image that is taller than the mask has no feature there
}

TEST(Mask, ItsRectanglesMakeItAgain) {
  Rng rng(5);
  for (int i = 0; i < 20; ++i) {
    Image seen(64, 48, 255);
    for (int k = 0; k < 4; ++k) {
      const double x = rng.uniform(-5, 64), y = rng.uniform(-5, 48), size = rng.uniform(1, 20);
      (void)(k % 2 == 0 ? hide(seen, MaskRectangle{x, y, size, 2 * size}) : hide(seen, MaskCircle{x, y, size}));
    }
    const Mask mask(seen);
    Image again(64, 48, 255);
    double pixels = 0;
    for (const MaskRectangle& r : mask.rectangles()) {
      EXPECT_TRUE(hide(again, r));
      pixels += r.width * r.height;
    }
    EXPECT_DOUBLE_EQ(pixels, mask.hidden_share() * 64 * 48);  // none twice
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x) EXPECT_EQ(again.at(x, y), seen.at(x, y));
  }
  EXPECT_EQ(mask_of(40, 30, {10, 5, 4, 3}).rectangles(), (std::vector<MaskRectangle>{{10, 5, 4, 3}}));
}

TEST(Mask, ACameraDoesNotSeeWhatIsHidden) {
  Camera camera(PinholeRadtan{200, 200, 60, 50, 0, 0, 0, 0}, 120, 100);
  EXPECT_TRUE(camera.inside({60, 95}, 4));
  camera.set_mask(std::make_shared<const Mask>(mask_of(120, 100, {50, 90, 20, 10})));
  EXPECT_FALSE(camera.inside({60, 92}));
  EXPECT_TRUE(camera.inside({60, 89}));
  EXPECT_FALSE(camera.inside({60, 84}, 6));  // six rows on lies a hidden one, as an image's edge would
  EXPECT_TRUE(camera.inside({60, 83}, 6));
  EXPECT_TRUE(camera.inside({60, 92}, -3));  // what may come into view
  const Camera behind = camera.with_lens(PinholeRadtan{210, 200, 60, 50, 0, 0, 0, 0});
  EXPECT_EQ(behind.mask(), camera.mask());
  EXPECT_EQ(behind.intrinsics()[0], 210);
}

TEST(Mask, ARigIsRefusedWhoseMaskIsWrong) {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{450, 450, 376, 240, 0, 0, 0, 0}, 752, 480), {}});
  rig.cameras[1].T_BC.p = Vec3(0.1, 0, 0);
  rig.cameras[1].camera.set_mask(std::make_shared<const Mask>(mask_of(752, 480, {0, 0, 752, 470})));
  EXPECT_TRUE(check_rig(rig, "rig").ok());
  rig.cameras[1].camera.set_mask(std::make_shared<const Mask>(mask_of(752, 480, {0, 0, 752, 480})));
  EXPECT_EQ(check_rig(rig, "rig").error().message, "rig: the right camera's mask hides all of the image");
  rig.cameras[1].camera.set_mask(std::make_shared<const Mask>(mask_of(640, 480, {0, 0, 10, 10})));
  EXPECT_EQ(check_rig(rig, "rig").error().message, "rig: the right camera's mask has 640 x 480 pixels, its images 752 x 480");
}

}  // namespace mask_test
}  // namespace fbvins
