// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/dark_squares.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace fbvins {
namespace {

constexpr int kTile_px = 4;           ///< black and white are looked for in tiles
constexpr int kLeastDifference = 12;  ///< grey values between black and white of a place
/// Where the corners of two squares meet it is half as bright as black and white together, whatever the blur: below half they
/// come apart there.
constexpr double kDark = 0.4;
constexpr int kSmallestBox_px = 8;
constexpr double kLeastFilled = 0.35;      ///< of the hull by dark pixels: a tag's are 0.6 and more, with its border
constexpr double kLeastQuadrangle = 0.83;  ///< of the hull by the four corners
constexpr double kLeastQuadSine = 0.25;    ///< sine

/// The image with black parts one pixel smaller: the largest of each pixel and its neighbours.
Image with_smaller_black(const ImageView& image) {
  Image wide(image.width, image.height), out(image.width, image.height);
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* in = image.row(y);
    std::uint8_t* row = wide.row(y);
    for (int x = 0; x < image.width; ++x)
      row[x] = std::max({in[std::max(x - 1, 0)], in[x], in[std::min(x + 1, image.width - 1)]});
  }
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t *above = wide.row(std::max(y - 1, 0)), *here = wide.row(y),
                       *below = wide.row(std::min(y + 1, image.height - 1));
    std::uint8_t* row = out.row(y);
    for (int x = 0; x < image.width; ++x) row[x] = std::max({above[x], here[x], below[x]});
  }
  return out;
}

/// Grey value of each tile below which a pixel is dark; 0 where black and white are not told apart.
class Threshold {
 public:
  Threshold(const ImageView& image, int reach_px)
      : columns_((image.width + kTile_px - 1) / kTile_px), rows_((image.height + kTile_px - 1) / kTile_px) {
    const auto count = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
    std::vector<std::uint8_t> black(count, 255), white(count, 0);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const std::size_t at = index(x, y);
        black[at] = std::min(black[at], image.row(y)[x]), white[at] = std::max(white[at], image.row(y)[x]);
      }
    const int reach = std::max(1, reach_px / kTile_px);
    const auto darker = [](std::uint8_t a, std::uint8_t b) { return std::min(a, b); };
    const auto brighter = [](std::uint8_t a, std::uint8_t b) { return std::max(a, b); };
    spread(black, reach, darker), spread(white, reach, brighter);
    dark_.resize(count);
    for (std::size_t i = 0; i < count; ++i)
      dark_[i] = white[i] - black[i] < kLeastDifference ? std::uint8_t{0}
                                                        : static_cast<std::uint8_t>(black[i] + kDark * (white[i] - black[i]));
  }

  bool dark(int x, int y, std::uint8_t grey) const { return grey < dark_[index(x, y)]; }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y / kTile_px) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(x / kTile_px);
  }

  /// Each tile gets the extreme of those around it: along rows, then along columns.
  template <typename Extreme>
  void spread(std::vector<std::uint8_t>& tiles, int reach, Extreme extreme) const {
    std::vector<std::uint8_t> out = tiles;
    const auto at = [&](int column, int row) {
      return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
    };
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column)
        for (int k = std::max(0, column - reach); k <= std::min(columns_ - 1, column + reach); ++k)
          out[at(column, row)] = extreme(out[at(column, row)], tiles[at(k, row)]);
    tiles = out;
    for (int row = 0; row < rows_; ++row)
      for (int k = std::max(0, row - reach); k <= std::min(rows_ - 1, row + reach); ++k)
        for (int column = 0; column < columns_; ++column)
          tiles[at(column, row)] = extreme(tiles[at(column, row)], out[at(column, k)]);
  }

  int columns_, rows_;
  std::vector<std::uint8_t> dark_;
};

/// Dark pixels of a row beside one another.
struct Run {
  int y, first, last;
  std::size_t part;  ///< a run that it hangs together with
};

std::size_t root(std::vector<Run>& runs, std::size_t i) {
  while (runs[i].part != i) i = runs[i].part = runs[runs[i].part].part;
  return i;
}

/// All runs, those that hang together with the same root.
std::vector<Run> runs_of(const ImageView& image, const Threshold& threshold) {
  std::vector<Run> runs;
  std::size_t above = 0, above_end = 0;
  for (int y = 0; y < image.height; ++y) {
    const std::size_t begin = runs.size();
    const std::uint8_t* row = image.row(y);
    for (int x = 0; x < image.width; ++x) {
      if (!threshold.dark(x, y, row[x])) continue;
      if (runs.size() > begin && runs.back().last == x - 1) runs.back().last = x;
      else runs.push_back({y, x, x, runs.size()});
    }
    std::size_t k = above;
    for (std::size_t i = begin; i < runs.size(); ++i) {
      while (k < above_end && runs[k].last < runs[i].first) ++k;
      for (std::size_t j = k; j < above_end && runs[j].first <= runs[i].last; ++j) {
        const std::size_t one = root(runs, i), other = root(runs, j);
        runs[std::max(one, other)].part = std::min(one, other);
      }
    }
    above = begin, above_end = runs.size();
  }
  return runs;
}

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Of points by rows; as an image shows them, with the clock.
std::vector<Vec2> hull_of(const std::vector<Vec2>& points) {
  std::vector<Vec2> hull;
  const auto add = [&](const Vec2& p, std::size_t least) {
    while (hull.size() > least && cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0) hull.pop_back();
    hull.push_back(p);
  };
  for (const Vec2& p : points) add(p, 1);
  const std::size_t least = hull.size();
  for (auto p = points.rbegin() + 1; p != points.rend(); ++p) add(*p, least);
  hull.pop_back();
  return hull;
}

double area_of(const auto& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) twice += cross(polygon[i], polygon[(i + 1) % polygon.size()]);
  return 0.5 * std::abs(twice);
}

/// The points of a hull that enclose most: from a first guess, one after another.
Quad largest_quadrangle(const std::vector<Vec2>& hull) {
  const auto farthest = [&](auto&& distance) {
    return *std::ranges::max_element(hull, {}, [&](const Vec2& p) { return static_cast<double>(distance(p)); });
  };
  Vec2 middle = Vec2::Zero();
  for (const Vec2& p : hull) middle += p / static_cast<double>(hull.size());
  Quad out;
  out[0] = farthest([&](const Vec2& p) { return (p - middle).squaredNorm(); });
  out[2] = farthest([&](const Vec2& p) { return (p - out[0]).squaredNorm(); });
  const Vec2 diagonal = out[2] - out[0];
  out[1] = farthest([&](const Vec2& p) { return cross(diagonal, p - out[0]); });
  out[3] = farthest([&](const Vec2& p) { return cross(p - out[0], diagonal); });
  for (int round = 0; round < 2; ++round)
    for (std::size_t k = 0; k < 4; ++k) {
      const Vec2 before = out[(k + 3) % 4], across = out[(k + 1) % 4] - before;
      out[k] = farthest([&](const Vec2& p) { return cross(across, p - before); });
    }
  return out;
}

/// Its edges moved outwards.
bool widen(Quad& quad, double by_px) {
  const Quad given = quad;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec2 before = (given[k] - given[(k + 3) % 4]).normalized(), after = (given[(k + 1) % 4] - given[k]).normalized();
    Eigen::Matrix2d outwards;
    outwards << -before.y(), before.x(), -after.y(), after.x();
    if (!(cross(before, after) < -kLeastQuadSine)) return false;
    quad[k] += outwards.inverse() * Vec2(by_px, by_px);
  }
  return true;
}

}  // namespace

std::vector<Quad> dark_squares(const ImageView& image, const DarkSquareOptions& options) {
  std::vector<Quad> out;
  if (image.empty()) return out;
  const Threshold threshold(image, options.reach_px);
  const Image smaller = options.smaller_px > 0 ? with_smaller_black(image) : Image();
  const ImageView looked_at = options.smaller_px > 0 ? smaller.view() : image;
  std::vector<Run> runs = runs_of(looked_at, threshold);
  for (std::size_t i = 0; i < runs.size(); ++i) runs[i].part = root(runs, i);
  std::ranges::stable_sort(runs, {}, &Run::part);
  for (std::size_t begin = 0, end = 0; begin < runs.size(); begin = end) {
    std::vector<Vec2> ends;
    int left = image.width, right = 0, count = 0;
    for (end = begin; end < runs.size() && runs[end].part == runs[begin].part; ++end) {
      const Run& run = runs[end];
      left = std::min(left, run.first), right = std::max(right, run.last), count += run.last - run.first + 1;
    }
    const int top = runs[begin].y, bottom = runs[end - 1].y;
    if (right - left < kSmallestBox_px || bottom - top < kSmallestBox_px) continue;
    if (left <= 0 || top <= 0 || right >= image.width - 1 || bottom >= image.height - 1) continue;
    for (std::size_t i = begin; i < end; ++i) {
      ends.emplace_back(runs[i].first, runs[i].y);
      if (runs[i].last > runs[i].first) ends.emplace_back(runs[i].last, runs[i].y);
    }
    const std::vector<Vec2> hull = hull_of(ends);
    if (hull.size() < 4) continue;
    Quad quad = largest_quadrangle(hull);
    const double hull_px2 = area_of(hull);
    if (count < kLeastFilled * hull_px2 || area_of(quad) < kLeastQuadrangle * hull_px2) continue;
    if (widen(quad, 0.5 + options.smaller_px)) out.push_back(quad);
  }
  return out;
}

}  // namespace fbvins
