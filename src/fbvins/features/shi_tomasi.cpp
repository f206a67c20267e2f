// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/shi_tomasi.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "fbvins/core/simd.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace fbvins {
namespace {

constexpr int kWindow = 7;  // side of the structure tensor's window
constexpr int kHalf = kWindow / 2;
constexpr int kStep = 16;                    // responses that are computed together
constexpr std::size_t kTooFewFeatures = 40;  // with fewer the whole image is searched
constexpr double kCrowding = 0.65;           // of the smallest distance, where empty cells did not give enough
constexpr std::size_t kPerCell = 6;          // candidates a cell may offer
constexpr int kBorder_px = 10;               // no corner is nearer to the image's edge
constexpr int kHidden = -1;                  // in place of a cell's features: the mask leaves none of it
/// Smallest response of a corner, (grey/px)^2, and as a multiple of the noise's own response; the larger counts.
constexpr double kMinResponse = 0.4;
constexpr double kNoiseFactor = 5.0;
/// Response per unit of noise variance: Sobel / 8 has 12/64 of the noise's variance, and the
/// smaller eigenvalue over a 7x7 window comes out about a third below the mean.
constexpr double kNoiseResponse = 0.12;

/// Products of the Sobel gradients of one row in place of those of the row that leaves the window; `sums` has those of the
/// window. xx, xy and yy are each `count` of both.
FBVINS_KERNEL
void move_window(const std::uint8_t* p, std::ptrdiff_t stride, int count, std::int32_t* __restrict products,
                 std::int32_t* __restrict sums) {
  const std::uint8_t* a = p - stride;
  const std::uint8_t* b = p + stride;
  const auto replace = [&](int at, int product) __attribute__((always_inline)) {
    sums[at] += product - products[at];
    products[at] = product;
  };
  for (int x = 0; x < count; ++x) {
    const int gx = a[x + 1] - a[x - 1] + 2 * (p[x + 1] - p[x - 1]) + b[x + 1] - b[x - 1];
    const int gy = b[x - 1] - a[x - 1] + 2 * (b[x] - a[x]) + b[x + 1] - a[x + 1];
    replace(x, gx * gx);
    replace(count + x, gx * gy);
    replace(2 * count + x, gy * gy);
  }
}

/// Of numbers that are not negative. GCC calls a function for the roots of a loop, for the sake of errno.
FBVINS_INLINE void take_roots(float (&x)[kStep]) {
  for (int i = 0; i < kStep; i += 4) {
#if defined(__x86_64__)
    _mm_storeu_ps(x + i, _mm_sqrt_ps(_mm_loadu_ps(x + i)));
#elif defined(__aarch64__)
    vst1q_f32(x + i, vsqrtq_f32(vld1q_f32(x + i)));
#else
    for (int k = i; k < i + 4; ++k) x[k] = std::sqrt(x[k]);
#endif
  }
}

/// Smaller eigenvalue of the window-mean structure tensor; column sums start kHalf left of out[0]. kStep at a time, the last
/// beyond `count`.
FBVINS_KERNEL
void response_row(const std::int32_t* sxx, const std::int32_t* sxy, const std::int32_t* syy, int count, float* out) {
  constexpr float scale = 0.5f / (64.0f * kWindow * kWindow);
  float trace[kStep], root[kStep];
  for (int first = 0; first < count; first += kStep) {
    for (int x = 0; x < kStep; ++x) {
      std::int32_t a = 0, b = 0, c = 0;
#pragma GCC unroll 7
      for (int i = first + x; i < first + x + kWindow; ++i) a += sxx[i], b += sxy[i], c += syy[i];
      const float fa = static_cast<float>(a), fb = static_cast<float>(b), fc = static_cast<float>(c);
      const float d = fa - fc;
      trace[x] = fa + fc;
      root[x] = d * d + 4.0f * fb * fb;
    }
    take_roots(root);
    for (int x = 0; x < kStep; ++x) out[first + x] = scale * (trace[x] - root[x]);
  }
}

bool stronger(const Corner& a, const Corner& b) {
  if (a.response != b.response) return a.response > b.response;
  return a.px.y() != b.px.y() ? a.px.y() < b.px.y() : a.px.x() < b.px.x();
}

/// Peak of the parabola through three samples, in (-0.5, 0.5).
double parabola_peak(float before, float at, float after) {
  const double curvature = static_cast<double>(before) - 2.0 * at + after;
  if (!(curvature < 0)) return 0;
  return std::clamp(0.5 * (before - after) / curvature, -0.5, 0.5);
}

}  // namespace

double estimate_noise(const PyramidLevel& image) {
  std::array<int, 1024> histogram{};
  int count = 0;
  for (int y = 4; y + 4 < image.height; y += 7) {
    const std::uint8_t* a = image.row(y - 1);
    const std::uint8_t* p = image.row(y);
    const std::uint8_t* b = image.row(y + 1);
    for (int x = 4 + y % 5; x + 4 < image.width; x += 5) {
      const int mask = a[x - 1] + a[x + 1] + b[x - 1] + b[x + 1] - 2 * (a[x] + b[x] + p[x - 1] + p[x + 1]) + 4 * p[x];
      ++histogram[static_cast<std::size_t>(std::min(std::abs(mask), 1023))];
      ++count;
    }
  }
  // The lower quartile belongs to the smooth parts of the image: |N(0, s)| has it at 0.319 s, and
  // the mask multiplies the noise by 6. Interpolated, because values are few in a quiet image.
  const double quarter = 0.25 * count;
  double below = 0;
  for (std::size_t value = 0; value < histogram.size(); ++value) {
    const double here = histogram[value];
    if (below + here >= quarter && here > 0) {
      const double magnitude = value == 0 ? 0.5 * (quarter - below) / here : value - 0.5 + (quarter - below) / here;
      return magnitude / (0.319 * 6.0);
    }
    below += here;
  }
  return 0;
}

bool ShiTomasiDetector::far_from_all(const Vec2& px, std::span<const Vec2> existing, double distance_px) const {
  const double limit = distance_px * distance_px;
  for (const Vec2& other : existing)
    if ((other - px).squaredNorm() < limit) return false;
  for (const Corner& other : corners_)
    if ((other.px - px).squaredNorm() < limit) return false;
  return true;
}

void ShiTomasiDetector::search_cell(const PyramidLevel& image, int column, int row, float threshold, const Mask* mask) {
  cell_corners_.clear();
  const int cell = cell_px_, border = kBorder_px;
  const int x0 = std::max(column * cell, border), x1 = std::min((column + 1) * cell, image.width - border);
  const int y0 = std::max(row * cell, border), y1 = std::min((row + 1) * cell, image.height - border);
  const int width = x1 - x0, height = y1 - y0;
  if (width <= 2 || height <= 2) return;

  // Responses with one pixel around for the comparison with neighbours.
  const int rw = width + 2, rh = height + 2;
  const int tw = rw + 2 * kHalf;  // tensors a row
  const auto line = static_cast<std::size_t>(3 * tw);
  response_.resize(static_cast<std::size_t>(rw) * rh + kStep);
  tensors_.assign(line * (kWindow + 1) + kStep, 0);
  std::int32_t* sums = tensors_.data() + line * kWindow;
  for (int i = 0; i < rh + 2 * kHalf; ++i) {
    // Ring of window rows: the row that leaves the window is zero until the ring is full.
    std::int32_t* slot = tensors_.data() + line * static_cast<std::size_t>(i % kWindow);
    move_window(image.row(y0 - 1 - kHalf + i) + x0 - 1 - kHalf, image.stride, tw, slot, sums);
    if (i >= 2 * kHalf)
      response_row(sums, sums + tw, sums + 2 * tw, rw, response_.data() + static_cast<std::ptrdiff_t>(i - 2 * kHalf) * rw);
  }

  for (int y = 0; y < height; ++y) {
    const float* r = response_.data() + static_cast<std::ptrdiff_t>(y + 1) * rw + 1;
    for (int x = 0; x < width; ++x) {
      const float v = r[x];
      // > before, >= after: of two equal neighbours exactly one is the maximum.
      if (v < threshold || !(v > r[x - 1]) || v < r[x + 1] || !(v > r[x - rw]) || v < r[x + rw]) continue;
      if (!(v > r[x - rw - 1]) || !(v > r[x - rw + 1]) || v < r[x + rw - 1] || v < r[x + rw + 1]) continue;
      // Before the strongest are chosen: what is hidden takes no place from what is seen.
      if (mask != nullptr && mask->hides(Vec2(x0 + x, y0 + y), kMaskMargin_px)) continue;
      const Vec2 offset(parabola_peak(r[x - 1], v, r[x + 1]), parabola_peak(r[x - rw], v, r[x + rw]));
      cell_corners_.push_back({Vec2(x0 + x, y0 + y) + offset, v});
    }
  }
  std::sort(cell_corners_.begin(), cell_corners_.end(), stronger);
}

void ShiTomasiDetector::accept(std::vector<Corner>& candidates, std::span<const Vec2> existing, double distance_px, int wanted) {
  std::sort(candidates.begin(), candidates.end(), stronger);
  for (const Corner& corner : candidates) {
    if (static_cast<int>(corners_.size()) >= wanted) return;
    if (far_from_all(corner.px, existing, distance_px)) corners_.push_back(corner);
  }
}

void ShiTomasiDetector::search_cells(const PyramidLevel& image, int columns, bool empty, float threshold,
                                     std::span<const Vec2> existing, int wanted, const Mask* mask) {
  best_.clear();
  others_.clear();
  // From where the last search stopped, so that every cell has its turn.
  int& next = next_cell_[empty ? 0 : 1];
  const int cells = static_cast<int>(occupancy_.size());
  const int budget = existing.size() < kTooFewFeatures
                         ? cells
                         : std::max(std::min(kFewestCells, cells_per_corner_ * wanted), empty ? wanted : 0);
  // Features close together are better than too few.
  const double distance_px = (empty ? 1.0 : kCrowding) * min_distance_px_;
  int searched = 0;
  for (int i = 0; i < cells && searched < budget; ++i) {
    next = (next + 1) % cells;
    const int occupied = occupancy_[static_cast<std::size_t>(next)];
    if (occupied == kHidden || (occupied == 0) != empty) continue;
    ++searched;
    search_cell(image, next % columns, next / columns, threshold, mask);
    std::size_t offered = 0;
    for (const Corner& corner : cell_corners_) {
      if (!far_from_all(corner.px, existing, distance_px)) continue;
      (offered == 0 ? best_ : others_).push_back(corner);
      if (++offered == kPerCell) break;
    }
  }
  accept(best_, existing, distance_px, wanted);
  accept(others_, existing, distance_px, wanted);
}

/// Once for a mask.
void ShiTomasiDetector::find_hidden_cells(const Mask& mask, int columns, int rows) {
  if (hidden_by_ == &mask && hidden_cells_.size() == static_cast<std::size_t>(columns) * rows) return;
  hidden_by_ = &mask;
  hidden_cells_.assign(static_cast<std::size_t>(columns) * rows, false);
  for (int cell = 0; cell < columns * rows; ++cell) {
    const int x = cell % columns * cell_px_, y = cell / columns * cell_px_;
    hidden_cells_[static_cast<std::size_t>(cell)] = mask.hides_all(x, y, x + cell_px_, y + cell_px_, kMaskMargin_px);
  }
}

const std::vector<Corner>& ShiTomasiDetector::detect(const Pyramid& pyramid, std::span<const Vec2> existing, int wanted,
                                                     const Mask* mask) & {
  corners_.clear();
  if (wanted <= 0 || pyramid.empty()) return corners_;
  const PyramidLevel& image = pyramid.level(0);
  noise_ = estimate_noise(image);
  const auto threshold = static_cast<float>(std::max(kMinResponse, kNoiseFactor * kNoiseResponse * noise_ * noise_));

  const int columns = (image.width + cell_px_ - 1) / cell_px_;
  const int rows = (image.height + cell_px_ - 1) / cell_px_;
  occupancy_.assign(static_cast<std::size_t>(columns) * rows, 0);
  for (const Vec2& px : existing) {
    const int column = static_cast<int>(px.x()) / cell_px_, row = static_cast<int>(px.y()) / cell_px_;
    if (column >= 0 && row >= 0 && column < columns && row < rows) ++occupancy_[static_cast<std::size_t>(row * columns + column)];
  }

  if (mask != nullptr) find_hidden_cells(*mask, columns, rows);
  for (std::size_t cell = 0; mask != nullptr && cell < occupancy_.size(); ++cell)
    if (hidden_cells_[cell]) occupancy_[cell] = kHidden;

  search_cells(image, columns, true, threshold, existing, wanted, mask);
  // Walls without texture leave cells empty for good; the missing corners are taken from the others.
  if (static_cast<int>(corners_.size()) < wanted) search_cells(image, columns, false, threshold, existing, wanted, mask);
  return corners_;
}

}  // namespace fbvins
