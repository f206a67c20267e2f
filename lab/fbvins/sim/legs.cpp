// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/legs.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/rng.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace {

/// Of the image's width: half a leg's width, its reach into the image, a patch of its paint.
constexpr double kHalfWidth = 0.024, kShortest = 0.16, kLongest = 0.28, kPatch = 0.009;
/// Reflectance of paint, and how much darker a round leg is at its sides.
constexpr double kDarkestPaint = 0.03, kBrightestPaint = 0.75, kSides = 0.5;
/// Mean reflectance of a room, by which the light follows from the mean radiance.
constexpr float kRoomReflectance = 0.45f;

}  // namespace

Legs::Legs(int width, int height, int count, int camera)
    : width_(width), height_(height), reflectance_(static_cast<std::size_t>(width) * height, -1.0f) {
  Rng rng(77, static_cast<std::uint64_t>(camera));
  for (int leg = 0; leg < count; ++leg) {
    // From the lower edge and the sides, where a vehicle's own legs are; the lower half alone.
    const double along = rng.uniform(0.1, 0.9), reach = width * rng.uniform(kShortest, kLongest);
    const double tilt = rng.uniform(-0.4, 0.4);
    const int from = leg % 3;  // below, left, right
    const Vec2 foot = from == 0   ? Vec2(along * width, height)
                      : from == 1 ? Vec2(0, (0.6 + 0.35 * along) * height)
                                  : Vec2(width, (0.6 + 0.35 * along) * height);
    const Vec2 direction = from == 0   ? Vec2(std::sin(tilt), -std::cos(tilt))
                           : from == 1 ? Vec2(std::cos(tilt), std::sin(tilt))
                                       : Vec2(-std::cos(tilt), std::sin(tilt));
    const double half_width = width * kHalfWidth * rng.uniform(0.8, 1.3), patch = width * kPatch;
    std::vector<double> paint(4096);
    for (double& grey : paint) grey = rng.uniform(kDarkestPaint, kBrightestPaint);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const Vec2 from_foot = Vec2(x, y) - foot;
        const double u = from_foot.dot(direction), v = direction.x() * from_foot.y() - direction.y() * from_foot.x();
        // Behind the foot, too: a leg that stands at an angle has no gap at the image's edge.
        if (u < -2 * half_width || u > reach || std::abs(v) > half_width) continue;
        const auto place =
            static_cast<std::size_t>(std::floor(u / patch) + 64) * 17 + static_cast<std::size_t>(std::floor(v / patch) + 64);
        const double round = 1 - kSides * (v / half_width) * (v / half_width);
        reflectance_[static_cast<std::size_t>(y) * width + x] = static_cast<float>(round * paint[place % paint.size()]);
      }
  }
}

void Legs::draw(std::vector<float>& radiance) const {
  double sum = 0;
  for (const float value : radiance) sum += std::min(value, 3.0f);  // a lamp counts as what is white
  const float light = static_cast<float>(sum / static_cast<double>(radiance.size())) / kRoomReflectance;
  for (std::size_t i = 0; i < radiance.size(); ++i)
    if (reflectance_[i] >= 0) radiance[i] = light * reflectance_[i];
}

Image Legs::seen() const {
  Image out(width_, height_, 255);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      if (reflectance_[static_cast<std::size_t>(y) * width_ + x] >= 0) out.at(x, y) = 0;
  return out;
}

}  // namespace fbvins
