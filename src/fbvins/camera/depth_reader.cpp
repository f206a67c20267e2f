// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/depth_reader.hpp"

#include <Eigen/Dense>
#include <cmath>

namespace fbvins {
namespace {

/// Half of the side of the window, and how many of its pixels need a depth.
constexpr int kRadius_px = 2;
constexpr int kFewest = 18;
/// An edge of depth passes where a depth of the window is off the plane by so many sigmas of the sensor.
constexpr double kEdge_sigma = 4;
/// Depths are whole millimetres.
constexpr double kRounding_m = 0.0005;

}  // namespace

std::optional<MeasuredInverseDepth> DepthReader::at(const DepthImage& image, const Vec2& px) const {
  const int x0 = static_cast<int>(std::lround(px.x())), y0 = static_cast<int>(std::lround(px.y()));
  if (x0 < kRadius_px || y0 < kRadius_px || x0 + kRadius_px >= width_ || y0 + kRadius_px >= height_) return std::nullopt;
  struct Sample {
    Vec3 at;
    double rho;
  };
  std::array<Sample, (2 * kRadius_px + 1) * (2 * kRadius_px + 1)> samples;
  std::size_t count = 0;
  Mat3 H = Mat3::Zero();
  Vec3 g = Vec3::Zero();
  for (int y = y0 - kRadius_px; y <= y0 + kRadius_px; ++y)
    for (int x = x0 - kRadius_px; x <= x0 + kRadius_px; ++x) {
      const double depth_m = 1e-3 * image.row(y)[x];
      if (depth_m < sensor_.nearest_m || depth_m > sensor_.farthest_m) continue;
      Sample& s = samples[count++] = {Vec3(1, x - px.x(), y - px.y()), 1 / depth_m};
      H += s.at * s.at.transpose();
      g += s.rho * s.at;
    }
  if (count < kFewest) return std::nullopt;
  const Vec3 plane = H.ldlt().solve(g);
  const double sigma = std::hypot(sensor_.noise_at_1m_m, kRounding_m * plane[0] * plane[0]);
  double squares = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double off = samples[i].rho - plane.dot(samples[i].at);
    if (!(std::abs(off) < kEdge_sigma * sigma)) return std::nullopt;
    squares += off * off;
  }
  return MeasuredInverseDepth{plane[0], std::sqrt(sigma * sigma + squares / static_cast<double>(count)), plane.tail<2>()};
}

}  // namespace fbvins
