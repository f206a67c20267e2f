// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/orb.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "fbvins/features/descriptor_stage.hpp"
#include "fbvins/features/hamming.hpp"
#include "fbvins/features/orb_pattern.hpp"
#include "tests/support/noise_texture.hpp"

namespace fbvins {
namespace orb_test {

using Warp = std::function<Vec2(const Vec2&)>;

const Vec2 kCentre(188, 120);

Warp similarity(double angle, double scale) {
  return [=](const Vec2& p) { return Vec2(kCentre + Eigen::Rotation2Dd(angle) * (p - kCentre) / scale); };
}

/// Pixel -> texture, after which texture coordinates of matches are compared.
struct Picture {
  Warp warp;
  OrbFeatures features;
};

Picture picture(const Warp& warp, double contrast = 35, double noise = 1.5, std::uint64_t noise_seed = 1) {
  static const NoiseTexture texture(7, 80);
  Picture p{warp, {}};
  const Image image = render_texture(376, 240, texture, warp, 120, contrast, noise, noise_seed);
  OrbExtractor extractor(OrbOptions{.max_features = 300, .levels = 4}, true);  // covers a scale of 1.7
  extractor.extract(image.view(), p.features);
  return p;
}

struct Score {
  int matches = 0, correct = 0;
  double share() const { return matches > 0 ? static_cast<double>(correct) / matches : 0; }
};

Score match(const Picture& a, const Picture& b) {
  Score score;
  for (const DescriptorMatch& m : match_descriptors(a.features.descriptors, b.features.descriptors, {})) {
    const Vec2 p = a.warp(a.features.keypoints[static_cast<std::size_t>(m.a)].pixel);
    const Vec2 q = b.warp(b.features.keypoints[static_cast<std::size_t>(m.b)].pixel);
    ++score.matches;
    score.correct += (p - q).norm() < 3.0;
  }
  return score;
}

TEST(OrbPattern, PairsAreInsideDistinctAndRepeatable) {
  const auto pattern = make_orb_pattern(), again = make_orb_pattern();
  for (std::size_t i = 0; i < 256; ++i) {
    const PointPair& p = pattern[i];
    EXPECT_LE(p.ax * p.ax + p.ay * p.ay, kPatternRadius * kPatternRadius);
    EXPECT_LE(p.bx * p.bx + p.by * p.by, kPatternRadius * kPatternRadius);
    EXPECT_TRUE(p.ax != p.bx || p.ay != p.by);
    EXPECT_TRUE(p.ax == again[i].ax && p.ay == again[i].ay && p.bx == again[i].bx && p.by == again[i].by);
  }
}

TEST(Orb, BitsAreBalancedAndNearlyIndependent) {
  const Picture p = picture(similarity(0, 1));
  const auto& d = p.features.descriptors;
  ASSERT_GT(d.size(), 150u);
  // Corners resemble one another (and this texture is smooth), so unrelated ones are a little nearer than 128.
  double sum = 0, sum2 = 0, n = 0;
  for (std::size_t i = 0; i < d.size(); ++i)
    for (std::size_t j = i + 1; j < d.size(); ++j) {
      if ((p.features.keypoints[i].pixel - p.features.keypoints[j].pixel).norm() < 60) continue;
      const double h = hamming_distance(d[i], d[j]);
      sum += h, sum2 += h * h, n += 1;
    }
  const double mean = sum / n, sigma = std::sqrt(sum2 / n - mean * mean);
  EXPECT_NEAR(mean, 128, 30);
  EXPECT_LT(sigma, 28);
}

TEST(Orb, KeypointsAreSpreadAndWithinQuota) {
  const Picture p = picture(similarity(0, 1));
  EXPECT_LE(p.features.size(), 300u);
  EXPECT_GT(p.features.size(), 200u);
  int filled[4][3] = {};
  for (const Keypoint& k : p.features.keypoints) ++filled[static_cast<int>(k.pixel.x() / 94)][static_cast<int>(k.pixel.y() / 80)];
  for (const auto& column : filled)
    for (const int count : column) EXPECT_GT(count, 5);
}

TEST(Orb, OrientationTurnsWithTheImage) {
  const Picture a = picture(similarity(0, 1)), b = picture(similarity(0.7, 1));
  std::vector<double> errors;
  for (const DescriptorMatch& m : match_descriptors(a.features.descriptors, b.features.descriptors, {})) {
    const Keypoint& p = a.features.keypoints[static_cast<std::size_t>(m.a)];
    const Keypoint& q = b.features.keypoints[static_cast<std::size_t>(m.b)];
    if ((a.warp(p.pixel) - b.warp(q.pixel)).norm() > 3) continue;
    errors.push_back(std::abs(std::remainder(q.angle_rad + 0.7 - p.angle_rad, 2 * std::numbers::pi)));
  }
  ASSERT_GT(errors.size(), 30u);
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.12);
}

class OrbUnderRotation : public testing::TestWithParam<double> {};
TEST_P(OrbUnderRotation, Matches) {
  const Score s = match(picture(similarity(0, 1)), picture(similarity(GetParam(), 1), 35, 1.5, 2));
  EXPECT_GT(s.matches, 50);
  EXPECT_GT(s.share(), 0.85);
}
INSTANTIATE_TEST_SUITE_P(Angles, OrbUnderRotation, testing::Values(0.0, 0.3, 1.0, 2.0, 3.1));

class OrbUnderScale : public testing::TestWithParam<double> {};
TEST_P(OrbUnderScale, Matches) {
  const Score s = match(picture(similarity(0, 1)), picture(similarity(0.1, GetParam()), 35, 1.5, 2));
  EXPECT_GT(s.matches, 25);
  EXPECT_GT(s.share(), 0.8);
}
INSTANTIATE_TEST_SUITE_P(Scales, OrbUnderScale, testing::Values(0.75, 0.9, 1.2, 1.5));

TEST(Orb, MatchesUnderAHomographyAndHalfTheContrast) {
  const Warp tilt = [](const Vec2& p) {
    const Vec2 c = p - kCentre;
    return Vec2(kCentre + Vec2(1.05 * c.x() + 0.06 * c.y(), -0.04 * c.x() + 0.97 * c.y()) / (1 + 4e-4 * c.x() - 3e-4 * c.y()));
  };
  const Score s = match(picture(similarity(0, 1)), picture(tilt, 17, 1.5, 3));
  EXPECT_GT(s.matches, 50);
  EXPECT_GT(s.share(), 0.85);
}

TEST(Orb, WeakTextureStillHasFeatures) { EXPECT_GT(picture(similarity(0, 1), 6, 0.5).features.size(), 60u); }

TEST(Orb, BlackTinyAndEmptyImagesHaveNone) {
  OrbExtractor extractor(OrbOptions{});
  OrbFeatures features;
  for (const Image& image : {Image(376, 240, 0), Image(30, 10, 80), Image()}) {
    extractor.extract(image.view(), features);
    EXPECT_EQ(features.size(), 0u);
  }
}

TEST(Orb, SameImageSameBits) {
  const Picture a = picture(similarity(0.2, 1)), b = picture(similarity(0.2, 1));
  EXPECT_TRUE(a.features.descriptors == b.features.descriptors);
}

TEST(Orb, MarginsHaveTheSignsOfTheBitsAndDoNotFollowContrast) {
  const Picture a = picture(similarity(0, 1), 60, 0);
  ASSERT_EQ(a.features.margins.size(), a.features.size());
  for (std::size_t i = 0; i < a.features.size(); ++i) {
    double squares = 0;
    for (std::size_t b = 0; b < 256; ++b) {
      const int m = a.features.margins[i].of_bit[b];
      ASSERT_EQ(m > 0, (a.features.descriptors[i].bits[b / 64] >> (b % 64) & 1) != 0);
      squares += m * m;
    }
    EXPECT_NEAR(std::sqrt(squares / 256) * kMarginUnit, 1, 0.1);  // less what is saturated
  }
  // Half the contrast: the same margins but for the rounding of grey values.
  const Picture b = picture(similarity(0, 1), 30, 0);
  int compared = 0;
  for (std::size_t i = 0; i < a.features.size(); ++i)
    for (std::size_t j = 0; j < b.features.size(); ++j) {
      if (a.features.keypoints[i].pixel != b.features.keypoints[j].pixel) continue;
      if (std::abs(a.features.keypoints[i].angle_rad - b.features.keypoints[j].angle_rad) > 0.01) continue;
      double apart = 0;
      for (std::size_t k = 0; k < 256; ++k) {
        const double d = (a.features.margins[i].of_bit[k] - b.features.margins[j].of_bit[k]) * kMarginUnit;
        apart += d * d / 256;
      }
      EXPECT_LT(std::sqrt(apart), 0.25);
      ++compared;
    }
  EXPECT_GT(compared, 50);
}

TEST(Orb, MarginsAreComputedOnlyWhenAskedFor) {
  const NoiseTexture texture(7, 80);
  const Image image = render_texture(376, 240, texture, similarity(0, 1), 120, 35, 0, 1);
  OrbFeatures with, without;
  OrbExtractor(OrbOptions{}, true).extract(image.view(), with);
  OrbExtractor(OrbOptions{}).extract(image.view(), without);
  EXPECT_EQ(with.margins.size(), with.size());
  EXPECT_EQ(without.margins.size(), 0u);
  EXPECT_TRUE(with.descriptors == without.descriptors);
}

/// Share of margins whose signs differ.
double flipped(const std::array<std::int8_t, 256>& a, const std::array<std::int8_t, 256>& b) {
  int n = 0;
  for (std::size_t i = 0; i < 256; ++i) n += (a[i] > 0) != (b[i] > 0);
  return n / 256.0;
}

TEST(Orb, SurroundingsReachTwiceAsFarAndFeelHalfTheNoise) {
  const NoiseTexture texture(7, 80);
  const auto smooth = [](const Image& image, std::vector<std::uint8_t>& out, bool half) {
    Pyramid pyramid;
    pyramid.build(image.view(), 2);
    std::vector<std::uint16_t> scratch;
    return smooth_level(pyramid.level(half ? 1 : 0), out, scratch);
  };
  const auto margins = [&](const Image& image) {
    Margins m;
    std::vector<std::uint8_t> pixels;
    margins_of(compare(smooth(image, pixels, false), kCentre, Vec2(1, 0)), m.of_bit);
    margins_of(compare(smooth(image, pixels, true), 0.5 * kCentre, Vec2(1, 0)), m.around);
    return m;
  };
  const Image clean = render_texture(376, 240, texture, similarity(0, 1), 120, 35, 0, 1);
  const Margins m = margins(clean);
  double bit = 0, around = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Margins noisy = margins(render_texture(376, 240, texture, similarity(0, 1), 120, 35, 25, seed));
    bit += flipped(m.of_bit, noisy.of_bit) / 10, around += flipped(m.around, noisy.around) / 10;
  }
  EXPECT_LT(around, 0.7 * bit);

  Image changed = clean;  // 20 to 24 px to the right of the keypoint
  for (int y = 100; y < 140; ++y)
    for (int x = 208; x < 212; ++x) changed.at(x, y) = static_cast<std::uint8_t>(255 - changed.at(x, y));
  EXPECT_EQ(margins(changed).of_bit, m.of_bit);
  EXPECT_GT(flipped(margins(changed).around, m.around), 0.02);
}

TEST(Hamming, CountsBitsAndRefusesAmbiguousMatches) {
  Rng rng(4);
  std::vector<Descriptor> a(40);
  for (Descriptor& d : a)
    for (std::uint64_t& w : d.bits) w = (static_cast<std::uint64_t>(rng.next_u32()) << 32) | rng.next_u32();
  std::vector<Descriptor> b = a;
  for (int i = 0; i < 20; ++i) b[3].bits[static_cast<std::size_t>(i % 4)] ^= 1ull << (3 * i);
  EXPECT_EQ(hamming_distance(a[3], b[3]), 20);
  EXPECT_EQ(match_descriptors(a, b, {}).size(), 40u);
  b.push_back(b[7]);  // twice the same: no way to tell
  EXPECT_EQ(match_descriptors(a, b, {}).size(), 39u);
  EXPECT_TRUE(match_descriptors(a, {}, {}).empty());
}

TEST(DescriptorStage, IdentityChangesNothing) {
  OrbFeatures features = picture(similarity(0, 1)).features;
  const std::vector<Descriptor> before = features.descriptors;
  make_identity_stage()->improve(376, 240, features);
  EXPECT_TRUE(before == features.descriptors);
}

TEST(Orb, AnImageTooSmallForItsHalfHasNoSurroundings) {
  Image image(28, 28, 40);
  for (int y = 14; y < 28; ++y)
    for (int x = 14; x < 28; ++x) image.at(x, y) = 200;
  OrbFeatures features;
  OrbExtractor(OrbOptions{}, true).extract(image.view(), features);
  ASSERT_GT(features.size(), 0u);
  ASSERT_EQ(features.margins.size(), features.size());
  const Margins& margins = features.margins.front();
  EXPECT_TRUE(std::any_of(margins.of_bit.begin(), margins.of_bit.end(), [](int m) { return m != 0; }));
  EXPECT_TRUE(std::all_of(margins.around.begin(), margins.around.end(), [](int m) { return m == 0; }));
}

TEST(OrbExtractor, WhatIsHiddenTakesNoPlace) {
  const Image image = render_texture(
      376, 240, NoiseTexture(7, 80), [](const Vec2& p) { return p; }, 120, 35, 1.5, 1);
  Image seen(376, 240, 255);
  hide(seen, MaskRectangle{0, 120, 376, 120});
  hide(seen, MaskCircle{180, 60, 25});
  const Mask mask(seen);
  OrbExtractor extractor(OrbOptions{.max_features = 300, .levels = 4});
  OrbFeatures all, visible;
  extractor.extract(image.view(), all);
  extractor.extract(image.view(), visible, &mask);
  const auto count_visible = [&](const OrbFeatures& features) {
    return std::count_if(features.keypoints.begin(), features.keypoints.end(),
                         [&](const Keypoint& k) { return !mask.hides(k.pixel, kMaskMargin_px); });
  };
  EXPECT_EQ(count_visible(visible), static_cast<std::ptrdiff_t>(visible.size()));
  EXPECT_GT(static_cast<double>(visible.size()), 1.3 * static_cast<double>(count_visible(all)));
}

}  // namespace orb_test
}  // namespace fbvins
