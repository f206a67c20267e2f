// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/fixed_edges.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace fbvins {
namespace {

/// Mean gradient of an edge, grey values a pixel of the small image: more than noise has. Vignetting has as much towards the edge
/// of a wide lens's image, but nearly the same all around.
constexpr float kEdge = 2;
/// An edge agrees with its mean where it has this share of its strength: gain and light change.
constexpr float kStrength = 0.35f;
constexpr float kMostlyThere = 0.8f;
/// Square of the mean gradient against the mean square: near 1 of one edge, less where gain changes or dirt lets the scene shine
/// through. Different edges of the scene that meet at a pixel, such as a room's under its ceiling, leave a mean that is weak
/// beside each of them.
constexpr float kOneEdge = 0.15f;
/// What pixels so near have in common is vignetting, and no edge. Lengths and areas are in pixels of the small image.
constexpr int kAround_px = 15;
/// Gaps in a fixed thing that are filled, specks that are none, and the smallest thing.
constexpr int kGap_px = 5, kSpeck_px = 1, kSmallest_px = 80;
/// The outer side of an edge, where the scene shows through the blur.
constexpr int kSkirt_px = 1;

/// Eight times Sobel's gradient at the pixels of a row.
struct EightfoldGradient {
  const std::uint8_t *a, *p, *b;
  EightfoldGradient(const Image& image, int y) : a(image.row(y - 1)), p(image.row(y)), b(image.row(y + 1)) {}
  std::int16_t x(int u) const {
    return static_cast<std::int16_t>(a[u + 1] - a[u - 1] + 2 * (p[u + 1] - p[u - 1]) + b[u + 1] - b[u - 1]);
  }
  std::int16_t y(int u) const { return static_cast<std::int16_t>(b[u - 1] - a[u - 1] + 2 * (b[u] - a[u]) + b[u + 1] - a[u + 1]); }
};

/// Grey values a pixel.
Eigen::Vector2f gradient(const Image& image, int x, int y) {
  const EightfoldGradient row(image, y);
  return 0.125f * Eigen::Vector2f(static_cast<float>(row.x(x)), static_cast<float>(row.y(x)));
}

/// Sums over the squares around a row's pixels, from row to row; the image's border does not count.
class SquareSums {
 public:
  SquareSums(const std::vector<std::int32_t>& values, int width, int height, int around)
      : values_(values.data()), width_(width), height_(height), around_(around), columns_(static_cast<std::size_t>(width), 0) {
    for (int y = 1; y < std::min(around, height - 1); ++y) add(y, 1);
  }
  /// Rows in order from 1 on: of x = 1 to width - 2.
  void next(int y, std::vector<std::int32_t>& of_row) {
    if (y + around_ < height_ - 1) add(y + around_, 1);
    if (y - around_ - 1 >= 1) add(y - around_ - 1, -1);
    std::int32_t sum = 0;
    for (int x = 1; x < std::min(around_ + 1, width_ - 1); ++x) sum += columns_[static_cast<std::size_t>(x)];
    for (int x = 1; x + 1 < width_; ++x) {
      if (x + around_ < width_ - 1) sum += columns_[static_cast<std::size_t>(x + around_)];
      if (x - around_ - 1 >= 1) sum -= columns_[static_cast<std::size_t>(x - around_ - 1)];
      of_row[static_cast<std::size_t>(x)] = sum;
    }
  }

 private:
  void add(int y, std::int32_t sign) {
    const std::int32_t* const row = values_ + static_cast<std::ptrdiff_t>(y) * width_;
    for (int x = 0; x < width_; ++x) columns_[static_cast<std::size_t>(x)] += sign * row[x];
  }

  const std::int32_t* values_;
  int width_, height_, around_;
  std::vector<std::int32_t> columns_;
};

/// Black pixels and those at most `by` away from one.
Image grown(const Image& seen, int by) {
  const Mask mask(seen);
  Image out(seen.width(), seen.height(), 255);
  for (int y = 0; y < out.height(); ++y)
    for (int x = 0; x < out.width(); ++x)
      if (mask.hides(Vec2(x, y), by)) out.at(x, y) = 0;
  return out;
}

Image inverted(Image image) {
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) image.at(x, y) = static_cast<std::uint8_t>(255 - image.at(x, y));
  return image;
}

Image shrunk(const Image& seen, int by) { return inverted(grown(inverted(seen), by)); }

/// Makes connected black parts that have fewer pixels white.
void drop_small(Image& seen, int fewest) {
  Image done(seen.width(), seen.height(), 0);
  std::vector<std::pair<int, int>> part;
  for (int y = 0; y < seen.height(); ++y)
    for (int x = 0; x < seen.width(); ++x) {
      const auto take = [&](int u, int v) {
        if (u < 0 || v < 0 || u >= seen.width() || v >= seen.height() || seen.at(u, v) != 0 || done.at(u, v) != 0) return;
        done.at(u, v) = 1;
        part.emplace_back(u, v);
      };
      part.clear();
      take(x, y);
      for (std::size_t i = 0; i < part.size(); ++i) {
        const auto [u, v] = part[i];
        take(u - 1, v), take(u + 1, v), take(u, v - 1), take(u, v + 1);
      }
      if (part.size() < static_cast<std::size_t>(fewest))
        for (const auto& [u, v] : part) seen.at(u, v) = 255;
    }
}

}  // namespace

void FixedEdges::add(Look look) {
  if (looks_.empty()) {
    width_ = look.image->width(), height_ = look.image->height();
    sums_x_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0);
    sums_y_ = squares_ = sums_x_;
  }
  for (int y = 1; y + 1 < height_; ++y) {
    const EightfoldGradient gradients(*look.image, y);
    for (int x = 1; x + 1 < width_; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
      const std::int32_t by_x = gradients.x(x), by_y = gradients.y(x);
      sums_x_[i] += by_x;
      sums_y_[i] += by_y;
      squares_[i] += by_x * by_x + by_y * by_y;
    }
  }
  looks_.push_back(std::move(look));
}

/// Motion of a far point at a pixel of the small image by a small turn, px of the camera a radian: by its lens, at whose edge a
/// fisheye's is half of a pinhole's. Zero where the lens sees nothing.
Eigen::Matrix<float, 2, 3> FixedEdges::motion_by_turn(int x, int y) const {
  constexpr double kTurn_rad = 1e-3;
  Eigen::Matrix<float, 2, 3> out = Eigen::Matrix<float, 2, 3>::Zero();
  const Vec2 pixel(kReduction * x, kReduction * y);
  const auto ray = camera_.ray(pixel);
  for (int i = 0; ray && i < 3; ++i) {
    const auto there = camera_.pixel_of(*ray + kTurn_rad * Vec3::Unit(i).cross(*ray));
    if (!there) return Eigen::Matrix<float, 2, 3>::Zero();
    out.col(i) = ((*there - pixel) / kTurn_rad).cast<float>();
  }
  return out;
}

/// Whether an edge at the pixel stays while the scene moves across it. `shared` by vignetting.
bool FixedEdges::stays(int x, int y, const Eigen::Vector2f& shared) const {
  const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  const auto count = static_cast<float>(looks_.size());
  const Eigen::Vector2f sum = 0.125f * Eigen::Vector2f(static_cast<float>(sums_x_[i]), static_cast<float>(sums_y_[i]));
  const Eigen::Vector2f mean = sum / count - shared;
  if (mean.squaredNorm() < kEdge * kEdge) return false;
  const float squares = static_cast<float>(squares_[i]) / 64 - 2 * shared.dot(sum) + count * shared.squaredNorm();
  if (mean.squaredNorm() * count < kOneEdge * squares) return false;
  return stays_in_each_look(x, y, mean, shared);
}

bool FixedEdges::stays_in_each_look(int x, int y, const Eigen::Vector2f& mean, const Eigen::Vector2f& shared) const {
  const float strength = mean.norm();
  const Eigen::Vector2f across = mean / strength;
  std::vector<bool> there;
  int present = 0;
  for (const Look& look : looks_) {
    there.push_back((gradient(*look.image, x, y) - shared).dot(across) > kStrength * strength);
    present += there.back();
  }
  if (static_cast<float>(present) < kMostlyThere * static_cast<float>(looks_.size())) return false;
  const Eigen::RowVector3f by_turn = across.transpose() * motion_by_turn(x, y);
  int pairs = 0, stayed = 0;
  for (std::size_t i = kLooksApart; i < looks_.size(); ++i) {
    const Look& look = looks_[i];
    if (std::abs(look.moved_px.dot(across)) < kAcross_px ||
        std::abs(by_turn.dot(look.turned_rad)) < kAcross_px + by_turn.norm() * look.by_bias_rad)
      continue;
    ++pairs;
    stayed += there[i - kLooksApart] && there[i];
  }
  return pairs >= kFewestPairs && static_cast<float>(stayed) >= kMostlyThere * static_cast<float>(pairs);
}

Image FixedEdges::edges() const {
  Image out(width_, height_, 255);
  SquareSums squares_x(sums_x_, width_, height_, kAround_px), squares_y(sums_y_, width_, height_, kAround_px);
  std::vector<std::int32_t> around_x(static_cast<std::size_t>(width_)), around_y(around_x);
  const float scale = 0.125f / static_cast<float>(looks_.size());
  for (int y = 1; y + 1 < height_; ++y) {
    squares_x.next(y, around_x);
    squares_y.next(y, around_y);
    const int rows = std::min(height_ - 2, y + kAround_px) - std::max(1, y - kAround_px) + 1;
    for (int x = 1; x + 1 < width_; ++x) {
      const int columns = std::min(width_ - 2, x + kAround_px) - std::max(1, x - kAround_px) + 1;
      const auto i = static_cast<std::size_t>(x);
      const float share = scale / static_cast<float>(rows * columns);
      const Eigen::Vector2f shared(share * static_cast<float>(around_x[i]), share * static_cast<float>(around_y[i]));
      if (stays(x, y, shared)) out.at(x, y) = 0;
    }
  }
  return out;
}

Image FixedEdges::parts(Image seen) const {
  const ImageView all = seen.view();
  if (std::all_of(all.data, all.row(all.height), [](std::uint8_t value) { return value != 0; })) return seen;
  seen = shrunk(grown(seen, kGap_px), kGap_px);
  seen = grown(shrunk(seen, kSpeck_px), kSpeck_px);
  drop_small(seen, kSmallest_px);
  return grown(seen, kSkirt_px);
}

}  // namespace fbvins
