// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/tag_reading.hpp"

#include <algorithm>
#include <array>
#include <bit>

namespace fbvins {
namespace {

constexpr int kTags = 587;             ///< of the family
constexpr int kLeastTagContrast = 12;  ///< grey values between the border and the gap
constexpr int kMostWrongRead = 2;      ///< cells of a tag that nobody expects there
constexpr double kSharpening = 0.25;   ///< a cell of two pixels is as bright as its neighbours in part
constexpr double kAside = 0.2;         ///< of a cell: it is looked at in four places about its middle

using PatternGrey = Eigen::Matrix<double, 6, 6>;

/// From the square of edge 1, x to the second corner and y to the fourth, to pixels.
Mat3 homography(const Quad& c) {
  const Vec2 across = c[1] - c[2], down = c[3] - c[2], skew = c[0] - c[1] + c[2] - c[3];
  const double area = across.x() * down.y() - down.x() * across.y();
  const double g = (skew.x() * down.y() - down.x() * skew.y()) / area, h = (across.x() * skew.y() - skew.x() * across.y()) / area;
  Mat3 H;
  H << (c[1] - c[0] + g * c[1]), (c[3] - c[0] + h * c[3]), c[0], g, h, 1;
  return H;
}

std::optional<double> grey_at(const ImageView& image, const Vec2& at) {
  if (!(at.x() >= 0 && at.y() >= 0 && at.x() < image.width - 1 && at.y() < image.height - 1)) return std::nullopt;
  const int x = static_cast<int>(at.x()), y = static_cast<int>(at.y());
  const double fx = at.x() - x, fy = at.y() - y;
  const std::uint8_t *above = image.row(y) + x, *below = image.row(y + 1) + x;
  return (1 - fy) * ((1 - fx) * above[0] + fx * above[1]) + fy * ((1 - fx) * below[0] + fx * below[1]);
}

/// Grey values that change evenly over the tag: of places that lie evenly on both sides of its middle.
class Plane {
 public:
  void add(const Vec2& at, double grey) {
    const Vec2 p = at - Vec2(0.5, 0.5);
    sum_ += grey, moment_ += grey * p, square_ += 0.5 * p.squaredNorm(), ++count_;
  }
  double mean() const { return sum_ / count_; }
  double at(const Vec2& place) const { return mean() + moment_.dot(place - Vec2(0.5, 0.5)) / square_; }

 private:
  double sum_ = 0, square_ = 0;
  Vec2 moment_ = Vec2::Zero();
  int count_ = 0;
};

/// Grey values of the pattern's cells, and of black and white about them.
struct Patch {
  PatternGrey grey;  ///< rows upwards, as the square's y
  Plane black, white;
};

std::optional<Patch> patch_of(const ImageView& image, const Mat3& H, int border, double spacing) {
  const double across = cells_across(border), edge = 0.5 * border / across;
  const double gap = std::min(0.8, 0.5 * spacing * across) / across;
  const auto sample = [&](const Vec2& at) { return grey_at(image, Vec3(H * at.homogeneous()).hnormalized()); };
  Patch out;
  for (int i = 0; i < 6; ++i) {
    const double along = (border + i + 0.5) / across;
    for (const auto& [inside, outside] :
         {std::array{Vec2(along, edge), Vec2(along, -gap)}, std::array{Vec2(along, 1 - edge), Vec2(along, 1 + gap)},
          std::array{Vec2(edge, along), Vec2(-gap, along)}, std::array{Vec2(1 - edge, along), Vec2(1 + gap, along)}}) {
      const auto black = sample(inside), white = sample(outside);
      if (!black || !white) return std::nullopt;
      out.black.add(inside, *black), out.white.add(outside, *white);
    }
  }
  if (!(out.white.mean() - out.black.mean() > kLeastTagContrast)) return std::nullopt;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column) {
      double sum = 0;
      for (const double dx : {-kAside, kAside})
        for (const double dy : {-kAside, kAside}) {
          const auto grey = sample(Vec2(border + column + 0.5 + dx, border + row + 0.5 + dy) / across);
          if (!grey) return std::nullopt;
          sum += 0.25 * *grey;
        }
      out.grey(row, column) = sum;
    }
  return out;
}

/// 36 cells as in a code.
std::uint64_t word_of(const Patch& patch, int border) {
  const double across = cells_across(border);
  const auto place = [&](int row, int column) { return Vec2((border + column + 0.5) / across, (border + row + 0.5) / across); };
  const auto grey = [&](int row, int column) {
    const bool inside = row >= 0 && column >= 0 && row < 6 && column < 6;
    return inside ? patch.grey(row, column) : patch.black.at(place(row, column));
  };
  std::uint64_t out = 0;
  for (int row = 5; row >= 0; --row)
    for (int column = 0; column < 6; ++column) {
      const double around = grey(row - 1, column) + grey(row + 1, column) + grey(row, column - 1) + grey(row, column + 1);
      const double sharp = grey(row, column) + kSharpening * (4 * grey(row, column) - around);
      const Vec2 at = place(row, column);
      out = out << 1 | static_cast<std::uint64_t>(sharp < 0.5 * (patch.black.at(at) + patch.white.at(at)));
    }
  return out;
}

/// The cells as they are seen with the second corner as the first one.
std::uint64_t turned(std::uint64_t word) {
  std::uint64_t out = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column) out = out << 1 | (word >> (35 - (6 * (5 - column) + row)) & 1u);
  return out;
}

}  // namespace

Result<TagReader> TagReader::create(double spacing) {
  std::vector<std::uint64_t> codes;
  for (int id = 0; id < kTags; ++id) {
    const Result<TagCells> cells = tag_cells(id);
    if (!cells) return cells.error();
    std::uint64_t code = 0;
    for (std::size_t row = 1; row < 7; ++row)
      for (std::size_t column = 1; column < 7; ++column) code = code << 1 | static_cast<std::uint64_t>((*cells)[row][column]);
    codes.push_back(code);
  }
  return TagReader(std::move(codes), spacing);
}

std::optional<TagDetection> TagReader::read(const ImageView& image, const Quad& corners) const {
  TagDetection best;
  best.wrong_cells = kMostWrongRead + 1;
  for (const int border : {kKalibrBorder, kLibraryBorder}) {
    const auto patch = patch_of(image, homography(corners), border, spacing_);
    if (!patch) continue;
    std::uint64_t word = word_of(*patch, border);
    for (std::size_t turn = 0; turn < 4; ++turn, word = turned(word))
      for (std::size_t id = 0; id < codes_.size(); ++id) {
        const int wrong = std::popcount(word ^ codes_[id]);
        if (wrong >= best.wrong_cells) continue;
        best = {static_cast<int>(id), border, wrong, corners};
        std::ranges::rotate(best.corners, best.corners.begin() + static_cast<std::ptrdiff_t>(turn));
      }
  }
  return best.wrong_cells <= kMostWrongRead ? std::optional(best) : std::nullopt;
}

std::optional<int> TagReader::wrong_cells(const ImageView& image, const Quad& corners, int id, int border) const {
  const auto patch = patch_of(image, homography(corners), border, spacing_);
  if (!patch || id < 0 || id >= static_cast<int>(codes_.size())) return std::nullopt;
  return std::popcount(word_of(*patch, border) ^ codes_[static_cast<std::size_t>(id)]);
}

}  // namespace fbvins
