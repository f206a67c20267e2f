// SPDX-License-Identifier: Apache-2.0
#include "fbvins/faults/image_faults.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fbvins/core/angle.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kMostInCycle = 32;
constexpr double kSensorNoise = 2;  ///< grey levels
constexpr int kBlock_px = 16;

using Shared = std::shared_ptr<const Image>;

std::uint8_t grey(double value) { return static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0)); }

template <class NewValue>
void each_pixel(Image& image, NewValue&& value) {
  for (int y = 0; y < image.height(); ++y) {
    std::uint8_t* row = image.row(y);
    for (int x = 0; x < image.width(); ++x) row[x] = value(x, y, row[x]);
  }
}

void add_noise(Image& image, double gain, double sigma, Rng& rng) {
  each_pixel(image, [&](int, int, std::uint8_t v) { return grey(gain * v + sigma * rng.normal()); });
}

/// The image as it was at other positions; what comes from outside is the nearest pixel.
template <class From>
void move_pixels(Image& image, From&& from) {
  const Image before = image;
  each_pixel(image, [&](int x, int y, std::uint8_t) {
    const auto [u, v] = from(x, y);
    return before.at(std::clamp(static_cast<int>(std::lround(u)), 0, image.width() - 1),
                     std::clamp(static_cast<int>(std::lround(v)), 0, image.height() - 1));
  });
}

void turn(Image& image, double degrees) {
  const double c = std::cos(degrees * kDegree), s = std::sin(degrees * kDegree);
  const double cx = image.width() / 2.0, cy = image.height() / 2.0;
  move_pixels(image, [=](int x, int y) { return std::pair(cx + c * (x - cx) + s * (y - cy), cy - s * (x - cx) + c * (y - cy)); });
}

void blur(Image& image, int width) {
  const Image before = image;
  each_pixel(image, [&](int x, int y, std::uint8_t) {
    int sum = 0;
    for (int k = 0; k < width; ++k) sum += before.at(std::clamp(x + k - width / 2, 0, image.width() - 1), y);
    return static_cast<std::uint8_t>(sum / width);
  });
}

void break_blocks(Image& image, double share, Rng& rng) {
  for (int y0 = 0; y0 < image.height(); y0 += kBlock_px)
    for (int x0 = 0; x0 < image.width(); x0 += kBlock_px) {
      if (rng.uniform() >= share) continue;
      for (int y = y0; y < std::min(y0 + kBlock_px, image.height()); ++y)
        for (int x = x0; x < std::min(x0 + kBlock_px, image.width()); ++x)
          image.at(x, y) = static_cast<std::uint8_t>(rng.below(256));
    }
}

}  // namespace

void ImageFaultInjector::see(const StereoFrame& frame) {
  before_.push_back(frame);
  if (before_.size() > kMostInCycle + 1) before_.pop_front();
}

template <class Change>
void ImageFaultInjector::each_image(StereoFrame& frame, Change&& change) const {
  for (int i = 0; i < static_cast<int>(frame.images.size()); ++i)
    if (camera_ == kAllCameras || camera_ == i) change(*image_in(frame, i), i);
}

void ImageFaultInjector::alter(StereoFrame& frame) {
  const bool first = count_ == 0;
  frame.images.resize(std::max<std::size_t>(2, frame.images.size()));  // a missing image may be replaced, too
  const StereoFrame& previous = before_.size() > 1 ? before_[before_.size() - 2] : before_.back();
  if (first) held_ = previous;
  ++count_;
  const auto become = [&](const StereoFrame& other) {
    each_image(frame, [&](Shared& image, int camera) { image = other.image(camera); });
  };
  switch (fault_) {
    case ImageFault::frozen: return become(held_);
    case ImageFault::cycle:
      if (first)
        for (std::size_t i = before_.size() - std::min(before_.size(), static_cast<std::size_t>(amount_) + 1);
             i + 1 < before_.size(); ++i)
          loop_.push_back(before_[i]);
      if (!loop_.empty()) become(loop_[static_cast<std::size_t>(count_ - 1) % loop_.size()]);
      return;
    case ImageFault::each_twice:
      if (count_ % 2 == 0) become(previous);
      return;
    case ImageFault::late: return become(previous);
    case ImageFault::exchanged: frame.swap_left_right(); return;
    case ImageFault::same_twice: frame.set_image(1, frame.left()); return;
    default: break;
  }
  each_image(frame, [&](Shared& image, int camera) {
    if (image == nullptr) return;
    Image altered = *image;
    if (fault_ == ImageFault::torn) {
      if (const Shared old = previous.image(camera))
        each_pixel(altered, [&](int x, int y, std::uint8_t v) { return 2 * y < altered.height() ? v : old->at(x, y); });
    } else {
      alter_pixels(altered);
    }
    image = std::make_shared<const Image>(std::move(altered));
  });
}

void ImageFaultInjector::alter_pixels(Image& image) {
  const int w = image.width();
  const auto fill = [&](double value) { each_pixel(image, [=](int, int, std::uint8_t) { return grey(value); }); };
  switch (fault_) {
    case ImageFault::black: fill(0); break;
    case ImageFault::white: fill(255); break;
    case ImageFault::blank: fill(120), add_noise(image, 1, kSensorNoise, rng_); break;
    case ImageFault::dark: add_noise(image, amount_, kSensorNoise, rng_); break;
    case ImageFault::noise: add_noise(image, 1, amount_, rng_); break;
    case ImageFault::blur: blur(image, std::max(1, static_cast<int>(amount_))); break;
    case ImageFault::covered:
      each_pixel(image, [&](int x, int, std::uint8_t v) { return x < amount_ * w ? std::uint8_t{0} : v; });
      break;
    case ImageFault::flicker:
      if (count_ % 2 == 0) add_noise(image, amount_, kSensorNoise, rng_);
      break;
    case ImageFault::broken_blocks: break_blocks(image, amount_, rng_); break;
    case ImageFault::scroll: {
      const int shift = static_cast<int>(amount_ * count_) % w;
      move_pixels(image, [=](int x, int y) { return std::pair(static_cast<double>((x + shift) % w), static_cast<double>(y)); });
      break;
    }
    case ImageFault::shifted:
      move_pixels(image, [&](int x, int y) { return std::pair(static_cast<double>(x), y - amount_); });
      break;
    case ImageFault::turned: turn(image, amount_); break;
    case ImageFault::mirrored:
      move_pixels(image, [=](int x, int y) { return std::pair(w - 1.0 - x, static_cast<double>(y)); });
      break;
    default: break;
  }
}

}  // namespace fbvins
