// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/board_image.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

constexpr int kSamples = 16;  ///< of a pixel

std::vector<double> gaussian(double deviation) {
  const int reach = static_cast<int>(std::ceil(3.5 * deviation));
  std::vector<double> out;
  double sum = 0;
  for (int i = -reach; i <= reach; ++i) sum += out.emplace_back(std::exp(-0.5 * i * i / (deviation * deviation)));
  for (double& value : out) value /= sum;
  return out;
}

/// Along rows, then the result turned: twice, it is a blur in both directions.
std::vector<double> blurred_and_turned(const std::vector<double>& image, int width, int height,
                                       const std::vector<double>& kernel) {
  std::vector<double> out(image.size());
  const int reach = static_cast<int>(kernel.size() / 2);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int k = -reach; k <= reach; ++k) sum += kernel[k + reach] * image[y * width + std::clamp(x + k, 0, width - 1)];
      out[x * height + y] = sum;
    }
  return out;
}

}  // namespace

BoardCamera::BoardCamera(const Camera& camera, BoardPattern pattern, Background background)
    : width_(camera.width()), height_(camera.height()), pattern_(std::move(pattern)), background_(std::move(background)) {
  for (int y = 0; y <= height_; ++y)
    for (int x = 0; x <= width_; ++x) {
      const auto n = camera.undistort({x - 0.5, y - 0.5});
      rays_.push_back(n ? Vec3(Vec3(n->x(), n->y(), 1).normalized()) : Vec3(Vec3::Zero()));
    }
}

double BoardCamera::grey(const Vec3& origin_T, const Vec3& direction_T, const BoardImageOptions& options) const {
  const double along = -origin_T.z() / direction_T.z();
  if (along > 0) {
    const auto black = pattern_.black(origin_T.x() + along * direction_T.x(), origin_T.y() + along * direction_T.y());
    if (black) return *black ? options.black : options.white;
  }
  return background_ ? background_(origin_T, direction_T)
                     : 110 + 30 * std::sin(3 * direction_T.x()) * std::cos(2 * direction_T.y());
}

/// Whether the pixel, or the one around each of its corners, sees the sheet of paper.
bool BoardCamera::near_board(const Vec3& origin_T, const Mat3& R_TC, const Vec3* above, const Vec3* below) const {
  const Vec3 across = above[1] - above[0], down = below[0] - above[0];
  for (const Vec3& ray : {Vec3(above[0] - across - down), Vec3(above[1] + across - down), Vec3(below[0] - across + down),
                          Vec3(below[1] + across + down)}) {
    const Vec3 direction = R_TC * ray;
    const double along = -origin_T.z() / direction.z();
    if (along > 0 && pattern_.black(origin_T.x() + along * direction.x(), origin_T.y() + along * direction.y())) return true;
  }
  return false;
}

BoardCamera::Eyes::Eyes(const Instants& T_CnT) {
  for (const auto& pose : T_CnT) {
    origins.push_back(pose.inverse().p);
    rotations.push_back(pose.R().transpose());
  }
}

Image BoardCamera::render(const Instants& T_CnT, const BoardImageOptions& options, Rng& rng) const {
  const Eyes eyes(T_CnT);
  std::vector<double> light(static_cast<std::size_t>(width_) * height_, 0);
  for (int y = 0; y < height_; ++y) light_of_row(y, eyes, options, &light[static_cast<std::size_t>(y) * width_]);
  return exposed(std::move(light), options, rng);
}

Image BoardCamera::render(const std::function<Instants(int row)>& T_CnT_of_row, const BoardImageOptions& options,
                          Rng& rng) const {
  std::vector<double> light(static_cast<std::size_t>(width_) * height_, 0);
  for (int y = 0; y < height_; ++y) light_of_row(y, Eyes(T_CnT_of_row(y)), options, &light[static_cast<std::size_t>(y) * width_]);
  return exposed(std::move(light), options, rng);
}

void BoardCamera::light_of_row(int y, const Eyes& eyes, const BoardImageOptions& options, double* light) const {
  const auto& [origins, rotations] = eyes;
  for (int x = 0; x < width_; ++x) {
    const Vec3 *above = &rays_[y * (width_ + 1) + x], *below = above + width_ + 1;
    if (above[0].isZero() || above[1].isZero() || below[0].isZero() || below[1].isZero()) continue;
    if (!near_board(origins[0], rotations[0], above, below)) {
      const Vec3 middle = 0.25 * (above[0] + above[1] + below[0] + below[1]);
      light[x] = grey(origins[0], rotations[0] * middle, options);
      continue;
    }
    double sum = 0;
    const double shift = ((x * 7 + y * 11) % 16) / 16.0;
    for (int s = 0; s < kSamples; ++s) {
      // Every sample in a column and a row of its own, shifted from pixel to pixel: also edges along rows are where they are.
      const double fx = (s + shift) / kSamples, fy = (s * 7 % kSamples + shift) / kSamples;
      const Vec3 ray = (1 - fy) * ((1 - fx) * above[0] + fx * above[1]) + fy * ((1 - fx) * below[0] + fx * below[1]);
      // Instants take turns over the samples, so that each has samples all over the pixel.
      const std::size_t instant = static_cast<std::size_t>(s + s / 4) % origins.size();
      sum += grey(origins[instant], rotations[instant] * ray, options);
    }
    light[x] = sum / kSamples;
  }
}

Image BoardCamera::exposed(std::vector<double> light, const BoardImageOptions& options, Rng& rng) const {
  if (options.blur_px > 0) {
    const std::vector<double> kernel = gaussian(options.blur_px);
    light = blurred_and_turned(blurred_and_turned(light, width_, height_, kernel), height_, width_, kernel);
  }
  Image out(width_, height_);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      out.at(x, y) =
          static_cast<std::uint8_t>(std::clamp(std::lround(light[y * width_ + x] + options.noise * rng.normal()), 0l, 255l));
  return out;
}

}  // namespace fbvins
