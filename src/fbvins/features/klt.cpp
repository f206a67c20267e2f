// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/klt.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "fbvins/features/klt_kernels.hpp"

namespace fbvins {
namespace {

constexpr int kP = kKltPatch;

/// A separable bump that falls smoothly towards `reach` from the feature, so that what enters or leaves
/// the patch at its rim does not pull the result. Sum 1.
struct Window {
  alignas(64) float w[kP * kP];
  constexpr explicit Window(double reach) : w{} {
    double side[kP] = {}, sum = 0;
    for (int i = 0; i < kP; ++i) {
      const double u = (i - 0.5 * (kP - 1)) / reach;
      side[i] = u * u < 1 ? 1.0 - u * u : 0.0;
      sum += side[i];
    }
    for (int y = 0; y < kP; ++y)
      for (int x = 0; x < kP; ++x) w[y * kP + x] = static_cast<float>(side[y] * side[x] / (sum * sum));
  }
};
constexpr Window kWide(0.5 * kP + 0.5), kNarrow(6);

const float* weights(KltWindow window) { return window == KltWindow::wide ? kWide.w : kNarrow.w; }

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

/// Smallest weighted variance of grey values, and of the gradient in any direction, of a usable patch.
constexpr float kMinVariance = 0.05f;
constexpr float kMinGradientVariance = 0.003f;

bool finish_template(const float* grid, KltWindow window, KltLevelTemplate& out) {
  klt::TemplateMoments m;
  out.window = window;
  klt::differentiate(grid, weights(window), out.wt, out.wgx, out.wgy, m);
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
  klt::orthogonalise(weights(window), m.t, m.gx, m.gy, cx, cy, out.wt, out.wgx, out.wgy);
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
    klt::Projections sums;
    const Place& place = fit.compared;
    klt::project_patch(place.p, place.stride, place.fx, place.fy, patch.wgx, patch.wgy, patch.wt, sums);
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

Likeness likeness_of(const klt::PatchMoments& m, const KltLevelTemplate& patch) {
  const float variance = m.square - m.one * m.one;
  if (!(variance > 1e-3f)) return {0, std::max(0.0f, variance)};
  return {m.t / std::sqrt(variance * patch.energy), variance};
}

Likeness likeness_at(const Place& place, const KltLevelTemplate& patch) {
  klt::PatchMoments m;
  klt::patch_moments(place.p, place.stride, place.fx, place.fy, patch.wt, weights(patch.window), m);
  return likeness_of(m, patch);
}

}  // namespace

bool KltTemplate::cut(const Pyramid& pyramid, const Vec2& px, int finest, int last, KltWindow window) {
  coarsest = last;
  for (int l = finest; l <= std::min(last, pyramid.levels() - 1); ++l) {
    KltLevelTemplate& out = levels[static_cast<std::size_t>(l)];
    out.valid = false;
    const double scale = 1.0 / (1 << l);
    Place place;
    if (!place_patch(pyramid.level(l), px.x() * scale, px.y() * scale, 1, place)) continue;
    alignas(64) float grid[klt::kGrid * klt::kGridStride];
    klt::sample_grid(place.p - place.stride - 1, place.stride, place.fx, place.fy, grid);
    out.valid = finish_template(grid, window, out);
  }
  const int there = std::min(last + 1, std::max(finest, pyramid.levels()));
  for (auto l = static_cast<std::size_t>(there); l < levels.size(); ++l) levels[l].valid = false;
  return levels[static_cast<std::size_t>(finest)].valid;
}

void KltTemplate::extend(const Pyramid& pyramid, const Vec2& px, int last) {
  if (last > coarsest) (void)cut(pyramid, px, coarsest + 1, last);
}

bool KltReference::take(const Pyramid& pyramid, const Vec2& px) {
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

bool KltTemplate::cut_warped(const KltReference& reference, const Mat2& J_reference_now) {
  KltLevelTemplate& out = levels[0];
  out.valid = false;
  constexpr double reach = 0.5 * (klt::kGrid - 1);
  const Vec2 corner = reference.centre - reach * (J_reference_now.col(0) + J_reference_now.col(1));
  const Vec2 extent = reach * (J_reference_now.col(0).cwiseAbs() + J_reference_now.col(1).cwiseAbs());
  const Vec2 lowest = reference.centre - extent, highest = reference.centre + extent;
  constexpr double last = KltReference::kSide - 1.01;
  if (!(lowest.minCoeff() >= 0.01 && highest.maxCoeff() < last)) return false;
  alignas(64) float grid[klt::kGrid * klt::kGridStride];
  const Eigen::Matrix2f J = J_reference_now.cast<float>();
  klt::sample_warped(reference.pixels.data(), KltReference::kSide, static_cast<float>(corner.x()), static_cast<float>(corner.y()),
                     J(0, 0), J(0, 1), J(1, 0), J(1, 1), grid);
  out.valid = finish_template(grid, KltWindow::wide, out);
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
  klt::PatchMoments m;
  klt::pixel_moments(place.p, place.stride, patch.wt, weights(patch.window), m);
  return likeness_of(m, patch).correlation;
}

}  // namespace fbvins
