// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/klt.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "fbvins/core/simd.hpp"
#include "fbvins/features/lanes.hpp"

namespace fbvins {
namespace {

constexpr int kP = kKltPatch;
static_assert(kP == kLanes, "one patch row is one set of lanes");

/// Window: a separable bump that falls smoothly towards the edge, so that what enters or leaves
/// the patch at its rim does not pull the result. Sum 1.
struct Window {
  alignas(64) float w[kP * kP];
  constexpr Window() : w{} {
    double side[kP] = {}, sum = 0;
    for (int i = 0; i < kP; ++i) {
      const double u = (i - 0.5 * (kP - 1)) / (0.5 * kP + 0.5);
      side[i] = (1.0 - u * u);
      sum += side[i];
    }
    for (int y = 0; y < kP; ++y)
      for (int x = 0; x < kP; ++x) w[y * kP + x] = static_cast<float>(side[y] * side[x] / (sum * sum));
  }
};
constexpr Window kWindow;

/// Bilinear weights and the address of the patch's first sample.
struct Place {
  const std::uint8_t* p;
  std::ptrdiff_t stride;
  float fx, fy;
};

/// std::floor of numbers that fit an int: baseline x86-64 has no instruction for it.
int floor_of(double x) {
  const int truncated = static_cast<int>(x);
  return truncated - (x < truncated ? 1 : 0);
}

/// False when the patch (with `margin` samples around) would leave the padded level.
bool place_patch(const PyramidLevel& level, double x, double y, int margin, Place& place) {
  const double left = x - 0.5 * (kP - 1), top = y - 0.5 * (kP - 1);
  const int lowest = -kPyramidBorder + margin, reach = kP + margin + 1;
  const bool inside = left >= lowest && top >= lowest && left + reach <= level.width + kPyramidBorder &&
                      top + reach <= level.height + kPyramidBorder;
  if (!inside) return false;
  const int fl = floor_of(left), ft = floor_of(top);
  place = {level.row(ft) + fl, level.stride, static_cast<float>(left - fl), static_cast<float>(top - ft)};
  return true;
}

FBVINS_INLINE void blend_row(const std::uint8_t* p, float fx, F16& out) {
  F16 a, b;
  load_lanes(p, a);
  load_lanes(p + 1, b);
  out = a + (b - a) * fx;
}

/// Projections of an image patch onto a template's gradients and grey values.
struct Projections {
  float gx, gy, t;
};

/// What a correlation is made of: the projection onto the grey values, and the patch's own first two moments.
struct PatchMoments {
  float t, one, square;
};

FBVINS_KERNEL
void project_patch(const std::uint8_t* p, std::ptrdiff_t stride, float fx, float fy, const float* wgx, const float* wgy,
                   const float* wt, Projections& out) {
  F16 sgx = {}, sgy = {}, st = {}, upper, lower;
  blend_row(p, fx, upper);
  for (int y = 0; y < kP; ++y) {
    blend_row(p + (y + 1) * stride, fx, lower);
    const F16 value = upper + (lower - upper) * fy;
    upper = lower;
    F16 a, b, c;
    load_lanes(wgx + y * kP, a);
    load_lanes(wgy + y * kP, b);
    load_lanes(wt + y * kP, c);
    sgx += a * value;
    sgy += b * value;
    st += c * value;
  }
  out = {sum_lanes(sgx), sum_lanes(sgy), sum_lanes(st)};
}

/// What a row of samples adds to the moments of a patch.
FBVINS_INLINE void add_row(const F16& value, const float* wt, const float* w, F16& st, F16& s1, F16& s2) {
  F16 c, d;
  load_lanes(wt, c);
  load_lanes(w, d);
  st += c * value;
  const F16 weighted = d * value;
  s1 += weighted;
  s2 += weighted * value;
}

FBVINS_KERNEL
void patch_moments(const std::uint8_t* p, std::ptrdiff_t stride, float fx, float fy, const float* wt, const float* w,
                   PatchMoments& out) {
  F16 st = {}, s1 = {}, s2 = {}, upper, lower;
  blend_row(p, fx, upper);
  for (int y = 0; y < kP; ++y) {
    blend_row(p + (y + 1) * stride, fx, lower);
    const F16 value = upper + (lower - upper) * fy;
    upper = lower;
    add_row(value, wt + y * kP, w + y * kP, st, s1, s2);
  }
  out = {sum_lanes(st), sum_lanes(s1), sum_lanes(s2)};
}

/// The same of the pixels from p on, nothing interpolated.
FBVINS_KERNEL
void pixel_moments(const std::uint8_t* p, std::ptrdiff_t stride, const float* wt, const float* w, PatchMoments& out) {
  F16 st = {}, s1 = {}, s2 = {}, value;
  for (int y = 0; y < kP; ++y) {
    load_lanes(p + y * stride, value);
    add_row(value, wt + y * kP, w + y * kP, st, s1, s2);
  }
  out = {sum_lanes(st), sum_lanes(s1), sum_lanes(s2)};
}

struct TemplateMoments {
  float t, gx, gy, tt, tgx, tgy, gxx, gxy, gyy;
};

/// Template samples with one more on each side, rows kGridStride apart.
constexpr int kGrid = kP + 2;
constexpr int kGridStride = 32;

/// Bilinear samples of the image; p is the address of the grid's first sample.
FBVINS_KERNEL
void sample_grid(const std::uint8_t* p, std::ptrdiff_t stride, float fx, float fy, float* grid) {
  F16 upper, lower, upper_end, lower_end;
  blend_row(p, fx, upper);
  blend_row(p + 2, fx, upper_end);
  for (int y = 0; y < kGrid; ++y) {
    blend_row(p + (y + 1) * stride, fx, lower);
    blend_row(p + (y + 1) * stride + 2, fx, lower_end);
    store_lanes(upper + (lower - upper) * fy, grid + y * kGridStride);
    store_lanes(upper_end + (lower_end - upper_end) * fy, grid + y * kGridStride + 2);
    upper = lower;
    upper_end = lower_end;
  }
}

/// Bilinear samples of a block along a linear map: sample (x, y) lies at (u0 + x ux + y uy, v0 + x vx + y vy). Places and
/// weights of a row are computed as lanes, its pixels fetched one by one.
FBVINS_KERNEL
void sample_warped(const std::uint8_t* block, int side, float u0, float v0, float ux, float uy, float vx, float vy, float* grid) {
  constexpr int kRow = (kGrid + kLanes - 1) / kLanes * kLanes;
  float fu[kRow], fv[kRow];
  std::int32_t at[kRow], p00[kRow], p01[kRow], p10[kRow], p11[kRow];
  for (int y = 0; y < kGrid; ++y) {
    for (int x = 0; x < kRow; ++x) {
      const float u = u0 + static_cast<float>(x) * ux + static_cast<float>(y) * uy;
      const float v = v0 + static_cast<float>(x) * vx + static_cast<float>(y) * vy;
      const auto iu = static_cast<std::int32_t>(u), iv = static_cast<std::int32_t>(v);
      fu[x] = u - static_cast<float>(iu);
      fv[x] = v - static_cast<float>(iv);
      at[x] = iv * side + iu;
    }
    for (int x = 0; x < kGrid; ++x) {
      const std::uint8_t* p = block + at[x];
      p00[x] = p[0], p01[x] = p[1], p10[x] = p[side], p11[x] = p[side + 1];
    }
    for (int x = 0; x < kGrid; ++x) {
      const float top = static_cast<float>(p00[x]) + static_cast<float>(p01[x] - p00[x]) * fu[x];
      const float bottom = static_cast<float>(p10[x]) + static_cast<float>(p11[x] - p10[x]) * fu[x];
      grid[y * kGridStride + x] = top + (bottom - top) * fv[x];
    }
  }
}

/// Template and central-difference gradients of a grid, and their weighted moments.
FBVINS_KERNEL
void differentiate(const float* grid, const float* w, float* t, float* gx, float* gy, TemplateMoments& m) {
  F16 st = {}, sgx = {}, sgy = {}, stt = {}, stgx = {}, stgy = {}, sgxx = {}, sgxy = {}, sgyy = {};
  for (int y = 0; y < kP; ++y) {
    F16 value, left, right, above, below, weight;
    load_lanes(grid + (y + 1) * kGridStride + 1, value);
    load_lanes(grid + (y + 1) * kGridStride, left);
    load_lanes(grid + (y + 1) * kGridStride + 2, right);
    load_lanes(grid + y * kGridStride + 1, above);
    load_lanes(grid + (y + 2) * kGridStride + 1, below);
    load_lanes(w + y * kP, weight);
    const F16 dx = (right - left) * 0.5f;
    const F16 dy = (below - above) * 0.5f;
    store_lanes(value, t + y * kP);
    store_lanes(dx, gx + y * kP);
    store_lanes(dy, gy + y * kP);
    const F16 wv = weight * value, wdx = weight * dx, wdy = weight * dy;
    st += wv;
    sgx += wdx;
    sgy += wdy;
    stt += wv * value;
    stgx += wv * dx;
    stgy += wv * dy;
    sgxx += wdx * dx;
    sgxy += wdx * dy;
    sgyy += wdy * dy;
  }
  m = {sum_lanes(st),   sum_lanes(sgx),  sum_lanes(sgy),  sum_lanes(stt), sum_lanes(stgx),
       sum_lanes(stgy), sum_lanes(sgxx), sum_lanes(sgxy), sum_lanes(sgyy)};
}

/// In place: t - mean, g - mean - c (t - mean), each times the window.
FBVINS_KERNEL
void orthogonalise(const float* w, float mean_t, float mean_gx, float mean_gy, float cx, float cy, float* t, float* gx,
                   float* gy) {
  for (int y = 0; y < kP; ++y) {
    F16 weight, tv, gxv, gyv;
    load_lanes(w + y * kP, weight);
    load_lanes(t + y * kP, tv);
    load_lanes(gx + y * kP, gxv);
    load_lanes(gy + y * kP, gyv);
    tv = tv - mean_t;
    gxv = (gxv - mean_gx - tv * cx) * weight;
    gyv = (gyv - mean_gy - tv * cy) * weight;
    store_lanes(tv * weight, t + y * kP);
    store_lanes(gxv, gx + y * kP);
    store_lanes(gyv, gy + y * kP);
  }
}

/// Smallest weighted variance of grey values, and of the gradient in any direction, of a usable patch.
constexpr float kMinVariance = 0.05f;
constexpr float kMinGradientVariance = 0.003f;

bool finish_template(const float* grid, KltLevelTemplate& out) {
  TemplateMoments m;
  differentiate(grid, kWindow.w, out.wt, out.wgx, out.wgy, m);
  const float vtt = m.tt - m.t * m.t;
  if (!(vtt > kMinVariance)) return false;
  const float cx = (m.tgx - m.t * m.gx) / vtt, cy = (m.tgy - m.t * m.gy) / vtt;
  const float hxx = m.gxx - m.gx * m.gx - cx * cx * vtt;
  const float hxy = m.gxy - m.gx * m.gy - cx * cy * vtt;
  const float hyy = m.gyy - m.gy * m.gy - cy * cy * vtt;
  const float half_trace = 0.5f * (hxx + hyy);
  const float det = hxx * hyy - hxy * hxy;
  const float smallest = half_trace - std::sqrt(std::max(0.0f, half_trace * half_trace - det));
  if (!(smallest > kMinGradientVariance)) return false;
  orthogonalise(kWindow.w, m.t, m.gx, m.gy, cx, cy, out.wt, out.wgx, out.wgy);
  out.ihxx = hyy / det;
  out.ihxy = -hxy / det;
  out.ihyy = hxx / det;
  out.ctx = cx;
  out.cty = cy;
  out.energy = vtt;
  return true;
}

struct LevelFit {
  Vec2 px;
  Place compared{};  ///< where the template was last laid over the image: a step before px
  float gain = 1;
  int iterations = 0;
  KltStatus status = KltStatus::ok;
};

/// Gauss-Newton iterations on each pyramid level.
constexpr int kMaxIterations = 15;
/// Coarse levels only have to bring the next one within reach.
constexpr double kConvergedCoarse_px = 0.05;
/// Smallest normalised cross-correlation of an accepted patch.
constexpr double kMinCorrelation = 0.75;
/// A residual below this, grey values, is image noise and accepted whatever the correlation, if there is some.
constexpr double kMaxResidualNoise = 2.5;
constexpr float kSomeCorrelation = 0.3f;
/// Largest change of contrast between two patches, either way.
constexpr double kMaxGain = 20;
/// Longest step of one iteration.
constexpr double kMaxStep_px = 2;
/// A level may not carry the feature farther than this from where it started on that level.
constexpr double kMaxTravel_px = 10;

void align_level(const KltLevelTemplate& patch, const PyramidLevel& image, double convergence_px, LevelFit& fit) {
  const Vec2 start = fit.px;
  for (int i = 0; i < kMaxIterations; ++i) {
    if (!place_patch(image, fit.px.x(), fit.px.y(), 0, fit.compared)) {
      fit.status = KltStatus::outside;
      return;
    }
    Projections sums;
    const Place& place = fit.compared;
    project_patch(place.p, place.stride, place.fx, place.fy, patch.wgx, patch.wgy, patch.wt, sums);
    ++fit.iterations;
    const float asx = patch.ihxx * sums.gx + patch.ihxy * sums.gy;
    const float asy = patch.ihxy * sums.gx + patch.ihyy * sums.gy;
    fit.gain = sums.t / patch.energy - patch.ctx * asx - patch.cty * asy;
    if (!(fit.gain * kMaxGain > 1 && fit.gain < kMaxGain)) {
      fit.status = KltStatus::diverged;
      return;
    }
    Vec2 step(asx / fit.gain, asy / fit.gain);
    const double length = step.norm();
    if (length > kMaxStep_px) step *= kMaxStep_px / length;
    fit.px -= step;
    if ((fit.px - start).squaredNorm() > kMaxTravel_px * kMaxTravel_px) {
      fit.status = KltStatus::diverged;
      return;
    }
    if (length < convergence_px) return;
  }
}

struct Likeness {
  float correlation, variance;  ///< with the template; of the image patch
};

Likeness likeness_of(const PatchMoments& m, const KltLevelTemplate& patch) {
  const float variance = m.square - m.one * m.one;
  if (!(variance > 1e-3f)) return {0, std::max(0.0f, variance)};
  return {m.t / std::sqrt(variance * patch.energy), variance};
}

Likeness likeness_at(const Place& place, const KltLevelTemplate& patch) {
  PatchMoments m;
  patch_moments(place.p, place.stride, place.fx, place.fy, patch.wt, kWindow.w, m);
  return likeness_of(m, patch);
}

}  // namespace

bool KltTemplate::cut(const Pyramid& pyramid, const Vec2& px, int finest, int coarsest) {
  for (int l = finest; l <= std::min(coarsest, pyramid.levels() - 1); ++l) {
    KltLevelTemplate& out = levels[static_cast<std::size_t>(l)];
    out.valid = false;
    const double scale = 1.0 / (1 << l);
    Place place;
    if (!place_patch(pyramid.level(l), px.x() * scale, px.y() * scale, 1, place)) continue;
    alignas(64) float grid[kGrid * kGridStride];
    sample_grid(place.p - place.stride - 1, place.stride, place.fx, place.fy, grid);
    out.valid = finish_template(grid, out);
  }
  for (int l = std::max(finest, pyramid.levels()); l <= coarsest; ++l) levels[static_cast<std::size_t>(l)].valid = false;
  return levels[static_cast<std::size_t>(finest)].valid;
}

bool KltAnchor::take(const Pyramid& pyramid, const Vec2& px) {
  const PyramidLevel& level = pyramid.level(0);
  const double fx = std::floor(px.x()), fy = std::floor(px.y());
  constexpr int half = kSide / 2;
  // The first pixel of the block is half - 1 left of the feature's own; the border repeats the edge.
  if (!(fx >= 0 && fy >= 0 && fx < level.width && fy < level.height)) return false;
  const int x0 = static_cast<int>(fx) - half + 1, y0 = static_cast<int>(fy) - half + 1;
  for (int y = 0; y < kSide; ++y) {
    const std::uint8_t* row = level.row(std::clamp(y0 + y, 0, level.height - 1));
    std::uint8_t* out = pixels.data() + y * kSide;
    if (x0 >= -kPyramidBorder && x0 + kSide <= level.width + kPyramidBorder) std::memcpy(out, row + x0, kSide);
    else
      for (int x = 0; x < kSide; ++x) out[x] = row[std::clamp(x0 + x, 0, level.width - 1)];
  }
  centre = Vec2(half - 1 + px.x() - fx, half - 1 + px.y() - fy);
  return true;
}

bool KltTemplate::cut_warped(const KltAnchor& anchor, const Mat2& J_anchor_now) {
  KltLevelTemplate& out = levels[0];
  out.valid = false;
  constexpr double reach = 0.5 * (kGrid - 1);
  const Vec2 corner = anchor.centre - reach * (J_anchor_now.col(0) + J_anchor_now.col(1));
  const Vec2 extent = reach * (J_anchor_now.col(0).cwiseAbs() + J_anchor_now.col(1).cwiseAbs());
  const Vec2 lowest = anchor.centre - extent, highest = anchor.centre + extent;
  constexpr double last = KltAnchor::kSide - 1.01;
  if (!(lowest.minCoeff() >= 0.01 && highest.maxCoeff() < last)) return false;
  alignas(64) float grid[kGrid * kGridStride];
  const Eigen::Matrix2f J = J_anchor_now.cast<float>();
  sample_warped(anchor.pixels.data(), KltAnchor::kSide, static_cast<float>(corner.x()), static_cast<float>(corner.y()), J(0, 0),
                J(0, 1), J(1, 0), J(1, 1), grid);
  out.valid = finish_template(grid, out);
  return out.valid;
}

KltResult klt_align(const KltTemplate& patch, const Pyramid& image, const Vec2& start_px, int coarsest, int finest,
                    double converged_px) {
  KltResult result;
  result.px = start_px;
  LevelFit fit;
  for (int l = std::min(coarsest, image.levels() - 1); l >= finest; --l) {
    const KltLevelTemplate& level_patch = patch.levels[static_cast<std::size_t>(l)];
    if (!level_patch.valid) continue;
    const double scale = 1 << l;
    fit = LevelFit{};
    fit.px = result.px / scale;
    const bool last = l == finest;
    align_level(level_patch, image.level(l), last ? converged_px : std::max(converged_px, kConvergedCoarse_px), fit);
    result.iterations += fit.iterations;
    if (fit.status == KltStatus::ok) result.px = fit.px * scale;
    else if (last) break;
  }
  if (!patch.levels[static_cast<std::size_t>(finest)].valid || image.levels() <= finest) return result;
  result.status = fit.status;
  if (fit.status != KltStatus::ok) return result;
  const PyramidLevel& full = image.level(0);
  if (result.px.x() < 0 || result.px.y() < 0 || result.px.x() > full.width - 1 || result.px.y() > full.height - 1) {
    result.status = KltStatus::outside;
    return result;
  }
  const Likeness likeness = likeness_at(fit.compared, patch.levels[static_cast<std::size_t>(finest)]);
  result.correlation = likeness.correlation;
  result.gain = fit.gain;
  result.residual = std::sqrt(std::max(0.0f, likeness.variance * (1 - result.correlation * result.correlation)));
  if (result.correlation < kMinCorrelation && !(result.correlation > kSomeCorrelation && result.residual < kMaxResidualNoise))
    result.status = KltStatus::poor_match;
  return result;
}

float klt_correlation(const KltLevelTemplate& patch, const PyramidLevel& level, const Vec2& px) {
  Place place;
  if (!patch.valid || !place_patch(level, px.x(), px.y(), 0, place)) return -1;
  return likeness_at(place, patch).correlation;
}

float klt_correlation_about(const KltLevelTemplate& patch, const PyramidLevel& level, const Vec2& px) {
  Place place;
  if (!patch.valid || !place_patch(level, px.x() + 0.5, px.y() + 0.5, 0, place)) return -1;
  PatchMoments m;
  pixel_moments(place.p, place.stride, patch.wt, kWindow.w, m);
  return likeness_of(m, patch).correlation;
}

}  // namespace fbvins
