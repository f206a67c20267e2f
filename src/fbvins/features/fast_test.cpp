// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/fast.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "fbvins/core/rng.hpp"
#include "fbvins/features/fast_cells.hpp"
#include "fbvins/features/scale_pyramid.hpp"

namespace fbvins {
namespace fast_test {

constexpr int kCircle[16][2] = {{0, -3}, {1, -3}, {2, -2}, {3, -1}, {3, 0},  {3, 1},   {2, 2},   {1, 3},
                                {0, 3},  {-1, 3}, {-2, 2}, {-3, 1}, {-3, 0}, {-3, -1}, {-2, -2}, {-1, -3}};

/// The definition (paper eq. 1 with N = 9), word for word.
bool is_corner(const Image& image, int x, int y, int threshold) {
  for (int sign : {1, -1})
    for (int start = 0; start < 16; ++start) {
      bool all = true;
      for (int k = 0; k < 9; ++k) {
        const auto& [dx, dy] = kCircle[(start + k) % 16];
        all = all && sign * (image.at(x + dx, y + dy) - image.at(x, y)) > threshold;
      }
      if (all) return true;
    }
  return false;
}

int naive_strength(const Image& image, int x, int y) {
  int t = 0;
  while (is_corner(image, x, y, t)) ++t;
  return t;
}

Image random_image(std::uint64_t seed, int width, int height, int range) {
  Image image(width, height);
  Rng rng(seed);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)  // blocks, so that corners exist
      image.at(x, y) = static_cast<std::uint8_t>(((x / 5 + y / 7 * 3) * 2654435761u >> 24) / (256 / range) + rng.below(8));
  return image;
}

TEST(Fast, StrengthIsTheLargestThresholdOfTheDefinition) {
  for (const int range : {8, 64, 247}) {
    const Image image = random_image(5, 83, 41, range);
    ScalePyramid pyramid;  // gives the padding
    pyramid.build(image.view(), 1, 1.2);
    std::vector<std::uint8_t> strength(128), limits(128, 6), found(4);
    for (int y = 3; y < 38; ++y) {
      fast_strength_row(pyramid.level(0).row(y) + 3, pyramid.level(0).stride, 77, limits.data(), strength.data(), found.data());
      for (int x = 3; x < 80; ++x) ASSERT_EQ(strength[x - 3], naive_strength(image, x, y)) << x << ' ' << y;
      for (int block = 0; block < 96; block += kFastBlock)
        ASSERT_EQ(found[block / kFastBlock],
                  std::any_of(&strength[block], &strength[block] + kFastBlock, [](std::uint8_t s) { return s > 6; }));
    }
  }
}

TEST(Fast, DetectsLocalMaximaOfTheDefinition) {
  const Image image = random_image(6, 150, 90, 200);
  ScalePyramid pyramid;
  pyramid.build(image.view(), 1, 1.2);
  FastBuffers buffers;
  std::vector<FastCorner> corners;
  const int border = 12, floor = 20;
  detect_fast(pyramid.level(0), border, floor, buffers, corners);
  std::set<std::pair<int, int>> found, expected;
  for (const FastCorner& c : corners) {
    found.insert({c.x, c.y});
    EXPECT_EQ(c.strength, naive_strength(image, c.x, c.y));
  }
  for (int y = border; y < 90 - border; ++y)
    for (int x = border; x < 150 - border; ++x) {
      const int s = naive_strength(image, x, y);
      bool best = s > floor;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const bool earlier = dy < 0 || (dy == 0 && dx < 0);
          if (dx == 0 && dy == 0) continue;
          const int other = naive_strength(image, x + dx, y + dy);
          best = best && (earlier ? s > other : s >= other);
        }
      if (best) expected.insert({x, y});
    }
  EXPECT_GT(expected.size(), 20u);
  EXPECT_EQ(found, expected);
}

/// All corners, and of each cell the strongest of them.
std::vector<FastCorner> strongest_of_cells(const PyramidLevel& level, int border, int floor) {
  FastBuffers buffers;
  std::vector<FastCorner> all, out;
  detect_fast(level, border, floor, buffers, all);
  const auto cell = [&](const FastCorner& c) { return std::pair(c.y / kFastCell_px, c.x / kFastCell_px); };
  std::stable_sort(all.begin(), all.end(), [&](const FastCorner& a, const FastCorner& b) {
    return cell(a) != cell(b) ? cell(a) < cell(b) : a.strength > b.strength;
  });
  for (std::size_t i = 0, rank = 0; i < all.size(); ++i) {
    rank = i > 0 && cell(all[i]) == cell(all[i - 1]) ? rank + 1 : 0;
    if (static_cast<int>(rank) < kFastPerCell) out.push_back(all[i]);
  }
  return out;
}

TEST(Fast, CellsKeepTheStrongestOfAllCorners) {
  FastCells cells;
  std::vector<FastCorner> found;
  for (const std::uint64_t seed : {7, 8, 9})
    for (const int range : {8, 40, 247})
      for (const int border : {4, 12, 33}) {
        Image image = random_image(seed, 201, 133, range);
        Rng rng(seed);  // plain noise has corners everywhere, of all strengths
        for (int y = 40; y < 133; ++y)
          for (int x = 60; x < 150; ++x) image.at(x, y) = static_cast<std::uint8_t>(rng.below(256));
        ScalePyramid pyramid;
        pyramid.build(image.view(), 1, 1.2);
        cells.detect(pyramid.level(0), border, 6, found);
        const std::vector<FastCorner> expected = strongest_of_cells(pyramid.level(0), border, 6);
        ASSERT_EQ(found.size(), expected.size());
        for (std::size_t i = 0; i < found.size(); ++i) {
          ASSERT_EQ(found[i].x, expected[i].x) << i;
          ASSERT_EQ(found[i].y, expected[i].y) << i;
          ASSERT_EQ(found[i].strength, expected[i].strength) << i;
        }
      }
}

TEST(Fast, FlatAndTinyImagesHaveNone) {
  FastBuffers buffers;
  std::vector<FastCorner> corners;
  for (const Image& image : {Image(100, 80, 0), Image(100, 80, 255), Image(20, 20, 9)}) {
    ScalePyramid pyramid;
    pyramid.build(image.view(), 1, 1.2);
    detect_fast(pyramid.level(0), 12, 1, buffers, corners);
    EXPECT_TRUE(corners.empty());
  }
}

}  // namespace fast_test
}  // namespace fbvins
