// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/mask.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

constexpr std::uint8_t kHalf = 128, kFar_px = 255;

/// Blackens the pixels of rows y0 to y1 - 1 and columns x0 to x1 - 1 for which inside(x, y).
template <class Inside>
bool hide_where(Image& seen, double x0, double y0, double x1, double y1, const Inside& inside) {
  const auto bound = [](double value, int side) { return static_cast<int>(std::clamp(std::ceil(value), 0.0, 1.0 * side)); };
  bool any = false;
  for (int y = bound(y0, seen.height()); y < bound(y1, seen.height()); ++y)
    for (int x = bound(x0, seen.width()); x < bound(x1, seen.width()); ++x) {
      if (!inside(x, y)) continue;
      seen.at(x, y) = 0;
      any = true;
    }
  return any;
}

}  // namespace

bool hide(Image& seen, const MaskRectangle& r) {
  return hide_where(seen, r.x, r.y, r.x + r.width, r.y + r.height, [](int, int) { return true; });
}

bool hide(Image& seen, const MaskCircle& c) {
  return hide_where(seen, c.x - c.radius, c.y - c.radius, c.x + c.radius + 1, c.y + c.radius + 1,
                    [&](int x, int y) { return std::hypot(x - c.x, y - c.y) <= c.radius; });
}

/// Two passes over the image: each pixel is one farther from what is hidden than the nearest of its neighbours.
Mask::Mask(const Image& seen) : width_(seen.width()), height_(seen.height()) {
  distance_px_.resize(static_cast<std::size_t>(width_) * height_);
  const auto at = [&](int x, int y) -> std::uint8_t& { return distance_px_[static_cast<std::size_t>(y) * width_ + x]; };
  const auto relax = [&](int x, int y, int from_x, int from_y) {
    if (from_x >= 0 && from_x < width_ && from_y >= 0 && from_y < height_)
      at(x, y) = static_cast<std::uint8_t>(std::min<int>(at(x, y), std::min<int>(at(from_x, from_y) + 1, kFar_px)));
  };
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      at(x, y) = seen.at(x, y) < kHalf ? 0 : kFar_px;
      relax(x, y, x - 1, y);
      for (int i = -1; i <= 1; ++i) relax(x, y, x + i, y - 1);
    }
  for (int y = height_ - 1; y >= 0; --y)
    for (int x = width_ - 1; x >= 0; --x) {
      relax(x, y, x + 1, y);
      for (int i = -1; i <= 1; ++i) relax(x, y, x + i, y + 1);
    }
}

bool Mask::hides(const Vec2& pixel, double margin_px) const {
  const double x = std::round(pixel.x()), y = std::round(pixel.y());
  if (!(x >= 0 && y >= 0 && x < width_ && y < height_)) return false;
  return distance(static_cast<int>(x), static_cast<int>(y)) <= margin_px;
}

bool Mask::hides_all(int x0, int y0, int x1, int y1, double margin_px) const {
  for (int y = std::max(y0, 0); y < std::min(y1, height_); ++y)
    for (int x = std::max(x0, 0); x < std::min(x1, width_); ++x)
      if (distance(x, y) > margin_px) return false;
  return true;
}

double Mask::hidden_share() const {
  return static_cast<double>(std::count(distance_px_.begin(), distance_px_.end(), 0)) /
         std::max(1.0, static_cast<double>(distance_px_.size()));
}

Image Mask::image() const {
  Image seen(width_, height_, 255);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      if (distance(x, y) == 0) seen.at(x, y) = 0;
  return seen;
}

/// Runs of hidden pixels, joined with an equal run of the row above.
std::vector<MaskRectangle> Mask::rectangles() const {
  std::vector<MaskRectangle> out;
  std::vector<std::size_t> above, here;  // rectangles that reach the row before, and this one, from left to right
  for (int y = 0; y < height_; ++y) {
    here.clear();
    for (int x = 0; x < width_; ++x) {
      if (distance(x, y) != 0) continue;
      const int first = x;
      while (x < width_ && distance(x, y) == 0) ++x;
      const auto same = std::find_if(above.begin(), above.end(),
                                     [&](std::size_t i) { return out[i].x == first && out[i].x + out[i].width == x; });
      if (same != above.end()) ++out[*same].height;
      here.push_back(same != above.end() ? *same : out.size());
      if (same == above.end()) out.push_back({1.0 * first, 1.0 * y, 1.0 * (x - first), 1});
    }
    std::swap(above, here);
  }
  return out;
}

}  // namespace fbvins
