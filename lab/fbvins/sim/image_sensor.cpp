// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/image_sensor.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/simd.hpp"

namespace fbvins {
namespace {

/// Integer hash ("lowbias32").
inline std::uint32_t mix(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352dU;
  x ^= x >> 15;
  x *= 0x846ca68bU;
  return x ^ x >> 16;
}

/// Grey values with noise; the sum of eight random bytes is nearly normal.
FBVINS_KERNEL void digitise(const float* light, int count, float shot, float read2, float black, std::uint32_t key,
                            std::uint8_t* out) {
  for (int i = 0; i < count; ++i) {
    const std::uint32_t a = mix(static_cast<std::uint32_t>(i) * 2u + key), b = mix(static_cast<std::uint32_t>(i) * 2u + 1u + key);
    const std::uint32_t pairs = (a & 0x00ff00ffu) + (a >> 8 & 0x00ff00ffu) + (b & 0x00ff00ffu) + (b >> 8 & 0x00ff00ffu);
    const std::int32_t sum = static_cast<std::int32_t>((pairs & 0xffffu) + (pairs >> 16)) - 1020;
    const float normal = static_cast<float>(sum) * (1.0f / 209.0f);  // sqrt(8 * (256^2 - 1) / 12)
    const float value = light[i] > 0 ? light[i] : 0.0f;
    const float noisy = value + black + normal * std::sqrt(read2 + shot * value) + 0.5f;
    const float clamped = noisy < 0 ? 0.0f : noisy > 255.0f ? 255.0f : noisy;
    out[i] = static_cast<std::uint8_t>(static_cast<std::int32_t>(clamped));
  }
}

FBVINS_KERNEL void blur_row(const float* in, float* out, int count, float w0, float w1, float w2, std::ptrdiff_t step) {
  for (int i = 0; i < count; ++i)
    out[i] = w0 * in[i] + w1 * (in[i - step] + in[i + step]) + w2 * (in[i - 2 * step] + in[i + 2 * step]);
}

}  // namespace

ImageSensor::ImageSensor(const CameraModelOptions& options, const Camera& camera, double brightness, std::uint64_t seed)
    : options_(options),
      width_(camera.width()),
      height_(camera.height()),
      brightness_(brightness),
      seed_(seed),
      exposure_ms_(options.max_exposure_ms),
      log_product_(std::log(options.max_exposure_ms)) {
  const bool wide = camera.sees_backwards();
  falloff_.resize(static_cast<std::size_t>(width_) * height_);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      // 1 on the axis, 1 - vignetting at 45 degrees; a lens that sees backwards is built to be as bright towards its edge.
      const auto ray = camera.undistort(Vec2(x, y));  // none at 90 degrees and more, where this is 0
      const double lost = options.vignetting / (1 - options.vignetting);
      falloff_[static_cast<std::size_t>(y) * width_ + x] = static_cast<float>(wide || lost == 0 ? 1
                                                                              : ray ? 1 / (1 + ray->squaredNorm() * lost)
                                                                                    : 0);
    }
  // The exposure is that of what a lens shows, not of the black around its circle.
  lit_pixels_ = static_cast<double>(falloff_.size()) * (wide && camera.mask() ? 1 - camera.mask()->hidden_share() : 1);
}

void ImageSensor::follow(double mean_radiance, double share) {
  if (!options_.auto_exposure) return;
  const double lowest = std::log(options_.min_exposure_ms),
               highest = std::log(longer_ * options_.max_exposure_ms * options_.max_gain);
  const double wanted = std::log(options_.target_level / (options_.sensitivity * std::max(mean_radiance, 1e-6)));
  log_product_ = std::clamp(log_product_ + share * (wanted - log_product_), lowest, highest);
  divide_product();
}

/// Exposure first, gain for the rest.
void ImageSensor::divide_product() {
  const double product = std::exp(log_product_);
  exposure_ms_ = std::min(product, longer_ * options_.max_exposure_ms);
  gain_ = product / exposure_ms_;
  if (options_.gain_step_db > 0)
    gain_ = std::pow(10, options_.gain_step_db / 20 * std::round(20 * std::log10(gain_) / options_.gain_step_db));
}

void ImageSensor::allow_longer(double factor) {
  if (factor == longer_) return;
  longer_ = factor;
  if (options_.auto_exposure) divide_product();
}

void ImageSensor::settle(const std::vector<float>& radiance) {
  double sum = 0;
  const double white = 3.0;  // brighter pixels saturate and count as this
  for (std::size_t i = 0; i < radiance.size(); ++i) sum += std::min<double>(white, radiance[i] * falloff_[i]);
  follow(brightness_ * sum / lit_pixels_, 1.0);
}

Image ImageSensor::expose(std::vector<float>& radiance, std::int64_t frame) {
  if (options_.glare > 0) add_glare(radiance);
  const float scale = static_cast<float>(options_.sensitivity * exposure_ms_ * gain_ * brightness_);
  for (std::size_t i = 0; i < radiance.size(); ++i) radiance[i] *= scale * falloff_[i];
  if (options_.blur_px > 0) blur(radiance);
  double sum = 0;
  for (float v : radiance) sum += std::min(v, 255.0f);
  const double mean = std::max(1.0, sum / lit_pixels_);

  Image image(width_, height_);
  const float read = static_cast<float>(options_.read_noise * gain_);
  const std::uint32_t key =
      mix(static_cast<std::uint32_t>(seed_ ^ seed_ >> 32) + mix(static_cast<std::uint32_t>(frame) + 0x9e3779b9u));
  digitise(radiance.data(), width_ * height_, static_cast<float>(options_.shot_noise * gain_), read * read,
           static_cast<float>(options_.black_level), key, image.row(0));
  follow(mean / (options_.sensitivity * exposure_ms_ * gain_), 1 - std::exp(-1 / std::max(options_.exposure_lag_frames, 1e-3)));
  return image;
}

/// Separable Gaussian of five taps.
void ImageSensor::blur(std::vector<float>& image) {
  const double s2 = 2 * options_.blur_px * options_.blur_px;
  const double e1 = std::exp(-1 / s2), e2 = std::exp(-4 / s2), total = 1 + 2 * e1 + 2 * e2;
  const float w0 = static_cast<float>(1 / total), w1 = static_cast<float>(e1 / total), w2 = static_cast<float>(e2 / total);
  rows_.assign(static_cast<std::size_t>(width_ + 4) * static_cast<std::size_t>(height_ + 4), 0);
  const int stride = width_ + 4;
  std::vector<float> padded(static_cast<std::size_t>(stride));
  for (int y = -2; y < height_ + 2; ++y) {
    const float* row = image.data() + static_cast<std::ptrdiff_t>(std::clamp(y, 0, height_ - 1)) * width_;
    std::copy_n(row, width_, padded.begin() + 2);
    padded[0] = padded[1] = row[0];
    padded[static_cast<std::size_t>(stride) - 1] = padded[static_cast<std::size_t>(stride) - 2] = row[width_ - 1];
    blur_row(padded.data() + 2, rows_.data() + static_cast<std::ptrdiff_t>(y + 2) * stride, width_, w0, w1, w2, 1);
  }
  for (int y = 0; y < height_; ++y)
    blur_row(rows_.data() + static_cast<std::ptrdiff_t>(y + 2) * stride, image.data() + static_cast<std::ptrdiff_t>(y) * width_,
             width_, w0, w1, w2, stride);
}

/// Scatters a share of the light: over the neighbourhood (box means of blocks of 16 pixels) and over the whole image.
void ImageSensor::add_glare(std::vector<float>& image) const {
  constexpr int kBlock = 16;
  const int nx = (width_ + kBlock - 1) / kBlock, ny = (height_ + kBlock - 1) / kBlock;
  std::vector<float> blocks(static_cast<std::size_t>(nx * ny), 0), counts(blocks.size(), 0);
  double total = 0;
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      const float v = image[static_cast<std::size_t>(y) * width_ + x];
      blocks[static_cast<std::size_t>(y / kBlock * nx + x / kBlock)] += v;
      counts[static_cast<std::size_t>(y / kBlock * nx + x / kBlock)] += 1;
      total += v;
    }
  for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i] /= counts[i];
  for (int pass = 0; pass < 3; ++pass) {
    const std::vector<float> old = blocks;
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) {
        float sum = 0;
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx)
            sum += old[static_cast<std::size_t>(std::clamp(y + dy, 0, ny - 1) * nx + std::clamp(x + dx, 0, nx - 1))];
        blocks[static_cast<std::size_t>(y * nx + x)] = sum / 9;
      }
  }
  const float share = static_cast<float>(options_.glare),
              everywhere = static_cast<float>(total / static_cast<double>(image.size()));
  struct Between {  // two neighbouring blocks and the share of the second; a single block is both
    int first, second;
    float second_share;
  };
  const auto between = [](int pixel, int blocks_there) {
    const float f = (static_cast<float>(pixel) + 0.5f) / kBlock - 0.5f;
    const int i = std::clamp(static_cast<int>(std::floor(f)), 0, std::max(0, blocks_there - 2));
    return Between{i, std::min(i + 1, blocks_there - 1), std::clamp(f - static_cast<float>(i), 0.0f, 1.0f)};
  };
  std::vector<Between> columns;
  for (int x = 0; x < width_; ++x) columns.push_back(between(x, nx));
  std::vector<float> row(static_cast<std::size_t>(nx));
  for (int y = 0; y < height_; ++y) {
    const Between at = between(y, ny);
    const float *first = &blocks[static_cast<std::size_t>(at.first * nx)],
                *second = &blocks[static_cast<std::size_t>(at.second * nx)];
    for (int i = 0; i < nx; ++i) {
      const float near = (1 - at.second_share) * first[i] + at.second_share * second[i];
      row[static_cast<std::size_t>(i)] = share * (0.6f * near + 0.4f * everywhere);
    }
    float* pixels = &image[static_cast<std::size_t>(y) * width_];
    for (int x = 0; x < width_; ++x) {
      const auto [i, j, u] = columns[static_cast<std::size_t>(x)];
      pixels[x] = (1 - share) * pixels[x] + ((1 - u) * row[static_cast<std::size_t>(i)] + u * row[static_cast<std::size_t>(j)]);
    }
  }
}

}  // namespace fbvins
