// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/klt.hpp"

#include <gtest/gtest.h>

#include "fbvins/features/shi_tomasi.hpp"
#include "tests/support/noise_texture.hpp"

namespace fbvins {
namespace klt_test {

constexpr int kWidth = 320, kHeight = 240;

struct Summary {
  int tried = 0, accepted = 0;
  double median = 0, p95 = 0;
};

/// Corners of `then` followed into `now`, where the feature at p lies at p + motion.
Summary follow(const Image& then, const Image& now, const Vec2& motion, const Vec2& prediction = Vec2::Zero()) {
  Pyramid a, b;
  a.build(then.view(), 4);
  b.build(now.view(), 4);
  ShiTomasiDetector detector(22);
  Summary summary;
  std::vector<double> errors;
  KltTemplate patch;
  for (const Corner& corner : detector.detect(a, {}, 80)) {
    const Vec2 truth = corner.px + motion;
    if (truth.x() < 12 || truth.y() < 12 || truth.x() > kWidth - 13 || truth.y() > kHeight - 13) continue;
    ++summary.tried;
    if (!patch.cut(a, corner.px, 0, 3)) continue;
    const KltResult found = klt_align(patch, b, corner.px + prediction, 3, 0);
    if (!found.ok()) continue;
    ++summary.accepted;
    errors.push_back((found.px - truth).norm());
  }
  std::sort(errors.begin(), errors.end());
  if (!errors.empty()) {
    summary.median = errors[errors.size() / 2];
    summary.p95 = errors[errors.size() * 95 / 100];
  }
  return summary;
}

Image view(double mean, double contrast, const Vec2& motion, double noise = 0, std::uint64_t seed = 1) {
  return render_texture(
      kWidth, kHeight, NoiseTexture(11), [&](const Vec2& p) { return Vec2(p - motion); }, mean, contrast, noise, seed);
}

TEST(Klt, FindsSubPixelMotion) {
  const Image then = view(120, 35, Vec2::Zero());
  for (const Vec2& motion : {Vec2(0.25, -0.4), Vec2(3.37, 2.81), Vec2(-11.5, 7.3)}) {
    const Summary s = follow(then, view(120, 35, motion), motion);
    EXPECT_GE(s.accepted, 0.95 * s.tried) << motion.transpose();
    EXPECT_GE(s.tried, 20);
    EXPECT_LT(s.median, 0.03) << motion.transpose();
    EXPECT_LT(s.p95, 0.1) << motion.transpose();
  }
}

TEST(Klt, GainAndOffsetDoNotMatter) {
  const Vec2 motion(4.3, -2.6);
  const Image then = view(90, 14, Vec2::Zero());
  for (const auto& [mean, contrast] : {std::pair{90.0, 28.0}, {150.0, 14.0}, {40.0, 7.0}, {130.0, 40.0}}) {
    const Summary s = follow(then, view(mean, contrast, motion), motion);
    EXPECT_GE(s.accepted, 0.95 * s.tried) << mean << ' ' << contrast;
    EXPECT_LT(s.median, 0.05) << mean << ' ' << contrast;
  }
}

TEST(Klt, TenfoldExposureOfADimImage) {
  const Vec2 motion(2.4, 1.3);
  const Summary s = follow(view(10, 4, Vec2::Zero(), 0.5, 1), view(110, 40, motion, 1.0, 2), motion);
  EXPECT_GE(s.accepted, 0.9 * s.tried);
  EXPECT_LT(s.median, 0.1);
}

TEST(Klt, NoiseOfTwoGreyValues) {
  const Vec2 motion(5.7, 3.1);
  const Summary s = follow(view(120, 35, Vec2::Zero(), 2, 1), view(120, 35, motion, 2, 2), motion);
  EXPECT_GE(s.accepted, 0.95 * s.tried);
  EXPECT_LT(s.median, 0.06);
  EXPECT_LT(s.p95, 0.2);
}

/// Something near, from x = 150 on, before something far that moves by `behind` less.
Image edge_of_a_thing(double moved, double behind) {
  return render_texture(
      kWidth, kHeight, NoiseTexture(11),
      [&](const Vec2& p) {
        return p.x() >= 150 + moved ? Vec2(p.x() - moved, p.y()) : Vec2(p.x() - moved + behind + 400, p.y());
      },
      120, 35, 0, 1);
}

TEST(Klt, ANarrowWindowSeesLessOfWhatIsBehind) {
  Pyramid then, now;
  then.build(edge_of_a_thing(0, 0).view(), 1);
  now.build(edge_of_a_thing(1, 2).view(), 1);
  double wide = 0, narrow = 0;
  int n = 0;
  KltTemplate patch;
  for (double y = 20; y < kHeight - 20; y += 4) {
    const Vec2 px(155, y);
    std::vector<double> errors;
    for (const KltWindow window : {KltWindow::wide, KltWindow::narrow}) {
      if (!patch.cut(then, px, 0, 0, window)) continue;
      const KltResult found = klt_align(patch, now, px, 0, 0);
      if (found.ok()) errors.push_back(found.px.x() - px.x() - 1);
    }
    if (errors.size() < 2) continue;
    wide += errors[0] * errors[0], narrow += errors[1] * errors[1], ++n;
  }
  ASSERT_GT(n, 30);
  EXPECT_GT(std::sqrt(wide / n), 0.05);
  EXPECT_LT(std::sqrt(narrow / n), 0.6 * std::sqrt(wide / n));
}

TEST(Klt, RefusesWhatIsNotThere) {
  const Image then = view(120, 35, Vec2::Zero());
  const Image other = render_texture(
      kWidth, kHeight, NoiseTexture(99), [](const Vec2& p) { return p; }, 120, 35);
  const Summary s = follow(then, other, Vec2::Zero());
  // Lucas-Kanade maximises the correlation, so a few smooth patches find a likeness by chance.
  EXPECT_LE(s.accepted, 0.3 * s.tried);
  EXPECT_EQ(follow(then, Image(kWidth, kHeight, 0), Vec2::Zero()).accepted, 0);
  EXPECT_EQ(follow(then, Image(kWidth, kHeight, 255), Vec2::Zero()).accepted, 0);
}

TEST(Klt, RefusesTemplatesWithoutTextureOrOutside) {
  Pyramid flat, textured;
  flat.build(Image(kWidth, kHeight, 90).view(), 4);
  textured.build(view(120, 35, Vec2::Zero()).view(), 4);
  KltTemplate patch;
  EXPECT_FALSE(patch.cut(flat, Vec2(100, 100), 0, 3));
  EXPECT_FALSE(patch.cut(textured, Vec2(-30, 100), 0, 3));
  EXPECT_FALSE(patch.cut(textured, Vec2(100, std::nan("")), 0, 3));
  ASSERT_TRUE(patch.cut(textured, Vec2(100, 100), 0, 3));
  EXPECT_FALSE(klt_align(patch, textured, Vec2(5000, 100), 3, 0).ok());
  EXPECT_FALSE(klt_align(patch, textured, Vec2(std::nan(""), 100), 3, 0).ok());
  EXPECT_FALSE(klt_align(patch, Pyramid{}, Vec2(100, 100), 3, 0).ok());
  const KltResult itself = klt_align(patch, textured, Vec2(100, 100), 3, 0);
  EXPECT_TRUE(itself.ok());
  EXPECT_NEAR((itself.px - Vec2(100, 100)).norm(), 0, 1e-3);
  EXPECT_NEAR(itself.gain, 1, 1e-3);
  EXPECT_NEAR(itself.correlation, 1, 1e-4);
}

}  // namespace klt_test
}  // namespace fbvins
