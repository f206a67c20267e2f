// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/fast.hpp"

#include <gtest/gtest.h>

#include <algorithm>

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

/// Pixels stronger than `floor` and than their 3x3 neighbourhood, of equal ones the first in reading order.
std::vector<FastCorner> corners_of(const PyramidLevel& level, int border, int floor) {
  const int count = level.width - 2 * border + 2;  // one column and one row beyond the wanted area
  if (count <= 2) return {};
  const std::vector<std::uint8_t> limits(static_cast<std::size_t>(count + kFastBlock), 0);
  std::vector<std::vector<std::uint8_t>> strength;
  for (int y = border - 1; y <= level.height - border; ++y) {
    std::vector<std::uint8_t> found(limits.size());
    fast_strength_row(level.row(y) + border - 1, level.stride, count, limits.data(), strength.emplace_back(limits.size()).data(),
                      found.data());
  }
  std::vector<FastCorner> out;
  const auto at = [&](int x, int y) { return strength[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)]; };
  for (int y = 1; y + 1 < static_cast<int>(strength.size()); ++y)
    for (int x = 1; x + 1 < count; ++x) {
      const std::uint8_t s = at(x, y);
      bool best = s > floor;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          if (dx == 0 && dy == 0) continue;
          const bool earlier = dy < 0 || (dy == 0 && dx < 0);
          best = best && (earlier ? s > at(x + dx, y + dy) : s >= at(x + dx, y + dy));
        }
      if (best) out.push_back({static_cast<std::int16_t>(x + border - 1), static_cast<std::int16_t>(y + border - 1), s});
    }
  return out;
}

/// All corners, and of each cell the strongest of them.
std::vector<FastCorner> strongest_of_cells(const PyramidLevel& level, int border, int floor) {
  std::vector<FastCorner> all = corners_of(level, border, floor), out;
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
        ASSERT_GT(expected.size(), 20u);
        ASSERT_EQ(found.size(), expected.size());
        for (std::size_t i = 0; i < found.size(); ++i) {
          ASSERT_EQ(found[i].x, expected[i].x) << i;
          ASSERT_EQ(found[i].y, expected[i].y) << i;
          ASSERT_EQ(found[i].strength, expected[i].strength) << i;
        }
      }
}

TEST(Fast, FlatAndTinyImagesHaveNone) {
  FastCells cells;
  std::vector<FastCorner> corners;
  for (const Image& image : {Image(100, 80, 0), Image(100, 80, 255), Image(20, 20, 9)}) {
    ScalePyramid pyramid;
    pyramid.build(image.view(), 1, 1.2);
    cells.detect(pyramid.level(0), 12, 1, corners);
    EXPECT_TRUE(corners.empty());
  }
}

}  // namespace fast_test
}  // namespace fbvins
