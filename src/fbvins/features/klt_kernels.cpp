// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/klt_kernels.hpp"

#include "fbvins/core/simd.hpp"
#include "fbvins/features/lanes.hpp"

namespace fbvins::klt {
namespace {

constexpr int kP = kKltPatch;
static_assert(kP == kLanes, "one patch row is one set of lanes");

FBVINS_INLINE void blend_row(const std::uint8_t* p, float fx, F16& out) {
  F16 a, b;
  load_lanes(p, a);
  load_lanes(p + 1, b);
  out = a + (b - a) * fx;
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

}  // namespace

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

FBVINS_KERNEL
void pixel_moments(const std::uint8_t* p, std::ptrdiff_t stride, const float* wt, const float* w, PatchMoments& out) {
  F16 st = {}, s1 = {}, s2 = {}, value;
  for (int y = 0; y < kP; ++y) {
    load_lanes(p + y * stride, value);
    add_row(value, wt + y * kP, w + y * kP, st, s1, s2);
  }
  out = {sum_lanes(st), sum_lanes(s1), sum_lanes(s2)};
}

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

FBVINS_KERNEL
void sample_warped(const std::uint8_t* block, int side, float u0, float v0, float ux, float uy, float vx, float vy, float* grid) {
  // Places and weights of a row are computed as lanes, its pixels fetched one by one.
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

}  // namespace fbvins::klt
