// SPDX-License-Identifier: Apache-2.0
#include "training/native/warped_pair.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace fbvins {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Grey values as floats, row-major.
struct Plane {
  int width = 0, height = 0;
  std::vector<float> v;
  Plane(int w, int h) : width(w), height(h), v(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  float& at(int x, int y) {
    return v[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
  float held(int x, int y) { return at(std::clamp(x, 0, width - 1), std::clamp(y, 0, height - 1)); }
};

Plane plane_of(const ImageView& image) {
  Plane out(image.width, image.height);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) out.at(x, y) = image.row(y)[x];
  return out;
}

Image image_of(Plane& plane) {
  Image out(plane.width, plane.height);
  for (int y = 0; y < plane.height; ++y)
    for (int x = 0; x < plane.width; ++x) out.at(x, y) = static_cast<std::uint8_t>(std::clamp(plane.at(x, y) + 0.5f, 0.f, 255.f));
  return out;
}

/// One pass of a kernel with taps (dx, dy) apart, bilinear.
Plane blur_along(Plane& in, const std::vector<float>& kernel, double dx, double dy) {
  Plane out(in.width, in.height);
  const int half = static_cast<int>(kernel.size()) / 2;
  for (std::size_t k = 0; k < kernel.size(); ++k) {
    const double ox = (static_cast<int>(k) - half) * dx, oy = (static_cast<int>(k) - half) * dy;
    const int ix = static_cast<int>(std::floor(ox)), iy = static_cast<int>(std::floor(oy));
    const float fx = static_cast<float>(ox - ix), fy = static_cast<float>(oy - iy);
    const auto column = [&](int x) { return static_cast<std::size_t>(std::clamp(x, 0, in.width - 1)); };
    for (int y = 0; y < in.height; ++y) {
      const float* upper = &in.at(0, std::clamp(y + iy, 0, in.height - 1));
      const float* lower = &in.at(0, std::clamp(y + iy + 1, 0, in.height - 1));
      for (int x = 0; x < in.width; ++x) {
        const std::size_t l = column(x + ix), r = column(x + ix + 1);
        out.at(x, y) +=
            kernel[k] * ((1 - fy) * ((1 - fx) * upper[l] + fx * upper[r]) + fy * ((1 - fx) * lower[l] + fx * lower[r]));
      }
    }
  }
  return out;
}

std::vector<float> gaussian(double sigma) {
  const int half = static_cast<int>(std::ceil(2.5 * sigma));
  std::vector<float> kernel;
  double sum = 0;
  for (int i = -half; i <= half; ++i) sum += std::exp(-0.5 * i * i / (sigma * sigma));
  for (int i = -half; i <= half; ++i) kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma)) / sum));
  return kernel;
}

Plane defocus(Plane& in, double sigma) {
  const std::vector<float> kernel = gaussian(sigma);
  Plane once = blur_along(in, kernel, 1, 0);
  return blur_along(once, kernel, 0, 1);
}

/// Largest parameters of a random homography about the image's centre.
struct Motion {
  double turn_rad, zoom, shift, tilt;
};

Mat3 homography(int width, int height, const Motion& strength, Rng& rng) {
  const double angle = rng.uniform(-1, 1) * strength.turn_rad;
  const double zoom = std::exp(rng.uniform(-1, 1) * std::log(strength.zoom));
  const double stretch = std::exp(rng.uniform(-0.3, 0.3) * std::log(strength.zoom)), axis = rng.uniform(0, std::numbers::pi);
  const Mat3 centre = (Mat3() << 1, 0, -0.5 * width, 0, 1, -0.5 * height, 0, 0, 1).finished();
  const auto turn = [](double a) {
    return (Mat3() << std::cos(a), -std::sin(a), 0, std::sin(a), std::cos(a), 0, 0, 0, 1).finished();
  };
  Mat3 tilt = Mat3::Identity();
  tilt(2, 0) = rng.uniform(-1, 1) * strength.tilt / width;
  tilt(2, 1) = rng.uniform(-1, 1) * strength.tilt / width;
  Mat3 shift = Mat3::Identity();
  shift(0, 2) = rng.uniform(-1, 1) * strength.shift * width;
  shift(1, 2) = rng.uniform(-1, 1) * strength.shift * width;
  const Mat3 shape = turn(axis) * Vec3(stretch, 1 / stretch, 1).asDiagonal() * turn(-axis) * Vec3(zoom, zoom, 1).asDiagonal();
  return centre.inverse() * shift * tilt * shape * turn(angle) * centre;
}

/// The picture warped by H, smoothed first where it shrinks.
Plane warp(Plane& in, const Mat3& H, double zoom) {
  Plane source = zoom < 0.95 ? defocus(in, 0.5 * std::sqrt(1 / (zoom * zoom) - 1)) : in;
  Plane out(in.width, in.height);
  const Mat3 back = H.inverse();
  for (int y = 0; y < in.height; ++y)
    for (int x = 0; x < in.width; ++x) {
      const double w = 1 / (back(2, 0) * x + back(2, 1) * y + back(2, 2));
      const double px = (back(0, 0) * x + back(0, 1) * y + back(0, 2)) * w,
                   py = (back(1, 0) * x + back(1, 1) * y + back(1, 2)) * w;
      if (!(px > -2 && py > -2 && px < in.width + 1 && py < in.height + 1)) {
        out.at(x, y) = 100;
        continue;
      }
      const int ix = static_cast<int>(std::floor(px)), iy = static_cast<int>(std::floor(py));
      const float fx = static_cast<float>(px - ix), fy = static_cast<float>(py - iy);
      out.at(x, y) = (1 - fy) * ((1 - fx) * source.held(ix, iy) + fx * source.held(ix + 1, iy)) +
                     fy * ((1 - fx) * source.held(ix, iy + 1) + fx * source.held(ix + 1, iy + 1));
    }
  return out;
}

/// Multiplies each pixel by a factor: a linear gradient and two soft spots.
void light_unevenly(Plane& image, double strength, Rng& rng) {
  const double a = rng.uniform(0, 2 * std::numbers::pi), slope = rng.uniform(0, strength);
  struct Spot {
    double x, y, r, gain;
  } spot[2];
  for (Spot& s : spot)
    s = {rng.uniform(0, image.width), rng.uniform(0, image.height), rng.uniform(0.1, 0.5) * image.width,
         rng.uniform(-0.6, 1.0) * strength};
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      double f = 1 + slope * (std::cos(a) * (2.0 * x / image.width - 1) + std::sin(a) * (2.0 * y / image.height - 1));
      for (const Spot& s : spot) {
        const double d2 = ((x - s.x) * (x - s.x) + (y - s.y) * (y - s.y)) / (s.r * s.r);
        if (d2 < 1) f += s.gain * (1 - d2) * (1 - d2);
      }
      image.at(x, y) *= static_cast<float>(std::max(f, 0.05));
    }
}

/// Nearly normal, standard deviation 1: the sum of four random bytes.
float quick_normal(Rng& rng) {
  const std::uint32_t r = rng.next_u32();
  const auto sum = static_cast<float>((r & 255u) + (r >> 8 & 255u) + (r >> 16 & 255u) + (r >> 24));
  return (sum - 510.0f) * (1.0f / 147.8f);
}

Image expose(Plane image, const Damage& d, Rng& rng) {
  if (d.uneven_light > 0) light_unevenly(image, d.uneven_light, rng);
  if (d.defocus_px > 0.3) image = defocus(image, d.defocus_px);
  if (d.motion_px > 1.5) {
    const int taps = 2 * (static_cast<int>(std::ceil(d.motion_px)) / 2) + 1;
    const double step = d.motion_px / taps;
    image = blur_along(image, std::vector<float>(static_cast<std::size_t>(taps), 1.0f / static_cast<float>(taps)),
                       step * std::cos(d.motion_angle_rad), step * std::sin(d.motion_angle_rad));
  }
  // gamma by table, with an error far below one grey value
  constexpr int kSteps = 1024;
  std::vector<float> lit(kSteps + 1);
  for (int i = 0; i <= kSteps; ++i)
    lit[static_cast<std::size_t>(i)] = static_cast<float>(std::pow(static_cast<double>(i) / kSteps, d.gamma) * d.exposure);
  const float full = static_cast<float>(255 * d.gain), read2 = static_cast<float>(d.read_noise * d.read_noise);
  const float shot2 = static_cast<float>(full * full / d.photons);
  for (float& v : image.v) {
    const float light = lit[static_cast<std::size_t>(std::clamp(v * (kSteps / 255.0f), 0.0f, static_cast<float>(kSteps)))];
    v = full * light + std::sqrt(shot2 * light + read2) * quick_normal(rng);
  }
  return image_of(image);
}

double between(double lo, double hi, Rng& rng) { return std::exp(rng.uniform(std::log(lo), std::log(hi))); }

Damage mild(Rng& rng) {
  Damage d;
  d.gain = between(0.9, 1.1, rng);
  d.photons = between(4e3, 2e4, rng);
  d.read_noise = rng.uniform(0.5, 1.5);
  return d;
}

void change_light(Damage& d, Rng& rng) {
  d.gain = between(0.45, 1.8, rng);
  d.gamma = between(0.6, 1.65, rng);
  d.uneven_light = rng.uniform(0, 0.8);
}

void dim_and_blur(Damage& d, double strength, Rng& rng) {
  d.exposure = between(0.05, 0.4, rng);
  d.gain = rng.uniform(0.4, 0.9) / d.exposure;
  d.photons = between(1500, 6000, rng);
  d.read_noise = rng.uniform(1, 2.5);
  if (rng.uniform() < 0.6) {
    d.motion_px = rng.uniform(2, 8) * strength;
    d.motion_angle_rad = rng.uniform(0, std::numbers::pi);
  }
  if (rng.uniform() < 0.6) d.defocus_px = rng.uniform(0.4, 1.6) * strength;
}

}  // namespace

Damage random_damage(Condition condition, Rng& rng) {
  Damage d = mild(rng);
  if (condition == Condition::light) change_light(d, rng);
  if (condition == Condition::low_light) dim_and_blur(d, 1, rng);
  if (condition == Condition::all) {
    dim_and_blur(d, 0.7, rng);
    d.gamma = between(0.75, 1.35, rng);
    d.uneven_light = rng.uniform(0, 0.5);
  }
  return d;
}

Image damage(const ImageView& picture, const Damage& d, Rng& rng) { return expose(plane_of(picture), d, rng); }

WarpedPair make_warped_pair(const ImageView& picture, Condition condition, Rng& rng) {
  constexpr Motion kSmall{6 * kDegree, 1.06, 0.06, 0.06}, kWide{35 * kDegree, 1.4, 0.1, 0.35},
      kMiddle{15 * kDegree, 1.2, 0.08, 0.2};
  const Motion& motion = condition == Condition::viewpoint ? kWide : condition == Condition::all ? kMiddle : kSmall;
  const Damage da = mild(rng), db = random_damage(condition, rng);
  WarpedPair pair;
  pair.H_ba = homography(picture.width, picture.height, motion, rng);
  Plane source = plane_of(picture);
  pair.a = expose(source, da, rng);
  const double zoom = std::sqrt(std::abs(pair.H_ba.topLeftCorner<2, 2>().determinant()));
  pair.b = expose(warp(source, pair.H_ba, zoom), db, rng);
  return pair;
}

}  // namespace fbvins
