// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/klt_kernels.hpp"

#include "fbvins/core/simd.hpp"
#include "fbvins/features/lanes.hpp"

namespace fbvins::klt {
namespace {

constexpr int kP = kKltPatch;
static_assert(kP == kLanes, "one patch row is one set of lanes");

template <int N, int B>
FBVINS_INLINE void blend_row(const std::uint8_t* p, float fx, Lanes<float, N, B>& out) {
  Lanes<float, N, B> a, b;
  load_lanes(p, a);
  load_lanes(p + 1, b);
  out = a + (b - a) * fx;
}

/// With registers of B bytes.
template <int B>
struct Kernels {
  using F16 = Lanes<float, kLanes, B>;
  /// What a row of a grid has beyond a patch's.
  using End = Lanes<float, F16::kInPart, B>;

  /// Calls add(samples, place of the row's first sample in the patch) for each row.
  template <class Add>
  static FBVINS_INLINE void blend_rows(const std::uint8_t* p, std::ptrdiff_t stride, float fx, float fy, Add add) {
    F16 upper, lower;
    blend_row(p, fx, upper);
    for (int y = 0; y < kP; y += 2) {
#pragma GCC unroll 2
      for (int i = 0; i < 2; ++i) {
        p += stride;
        blend_row(p, fx, lower);
        add(upper + (lower - upper) * fy, (y + i) * kP);
        upper = lower;
      }
    }
  }

  /// What a row of samples adds to the moments of a patch.
  static FBVINS_INLINE void add_row(const F16& value, const float* wt, const float* w, F16& st, F16& s1, F16& s2) {
    F16 c, d;
    load_lanes(wt, c);
    load_lanes(w, d);
    st += c * value;
    const F16 weighted = d * value;
    s1 += weighted;
    s2 += weighted * value;
  }

  static FBVINS_INLINE void project_patch(const std::uint8_t* p, std::ptrdiff_t stride, float fx, float fy, const float* wgx,
                                          const float* wgy, const float* wt, Projections& out) {
    F16 sgx = {}, sgy = {}, st = {};
    blend_rows(
        p, stride, fx, fy, [&](const F16& value, int at) __attribute__((always_inline)) {
          F16 a, b, c;
          load_lanes(wgx + at, a);
          load_lanes(wgy + at, b);
          load_lanes(wt + at, c);
          sgx += a * value;
          sgy += b * value;
          st += c * value;
        });
    out = {sum_lanes(sgx), sum_lanes(sgy), sum_lanes(st)};
  }

  static FBVINS_INLINE void patch_moments(const std::uint8_t* p, std::ptrdiff_t stride, float fx, float fy, const float* wt,
                                          const float* w, PatchMoments& out) {
    F16 st = {}, s1 = {}, s2 = {};
    blend_rows(
        p, stride, fx,
        fy, [&](const F16& value, int at) __attribute__((always_inline)) { add_row(value, wt + at, w + at, st, s1, s2); });
    out = {sum_lanes(st), sum_lanes(s1), sum_lanes(s2)};
  }

  static FBVINS_INLINE void pixel_moments(const std::uint8_t* p, std::ptrdiff_t stride, const float* wt, const float* w,
                                          PatchMoments& out) {
    F16 st = {}, s1 = {}, s2 = {}, value;
    for (int y = 0; y < kP; ++y) {
      load_lanes(p + y * stride, value);
      add_row(value, wt + y * kP, w + y * kP, st, s1, s2);
    }
    out = {sum_lanes(st), sum_lanes(s1), sum_lanes(s2)};
  }

  static FBVINS_INLINE void sample_grid(const std::uint8_t* p, std::ptrdiff_t stride, float fx, float fy, float* grid) {
    F16 upper, lower;
    End upper_end, lower_end;
    blend_row(p, fx, upper);
    blend_row(p + kP, fx, upper_end);
    for (int y = 0; y < kGrid; ++y) {
      blend_row(p + (y + 1) * stride, fx, lower);
      blend_row(p + (y + 1) * stride + kP, fx, lower_end);
      store_lanes(upper + (lower - upper) * fy, grid + y * kGridStride);
      store_lanes(upper_end + (lower_end - upper_end) * fy, grid + y * kGridStride + kP);
      upper = lower;
      upper_end = lower_end;
    }
  }

  static FBVINS_INLINE void sample_warped(const std::uint8_t* block, int side, float u0, float v0, float ux, float uy, float vx,
                                          float vy, float* grid) {
    // Places and weights of a row are computed as lanes, its pixels fetched two by two.
    constexpr int kRow = (kGrid + F16::kInPart - 1) / F16::kInPart * F16::kInPart;
    float u_of_row[kRow], v_of_row[kRow], fu[kRow], fv[kRow];
    std::int32_t at[kRow];
    std::uint16_t upper[kRow], lower[kRow];
    for (int x = 0; x < kRow; ++x) {
      u_of_row[x] = u0 + static_cast<float>(x) * ux;
      v_of_row[x] = v0 + static_cast<float>(x) * vx;
    }
    for (int x = kGrid; x < kRow; ++x) upper[x] = lower[x] = 0;
    for (int y = 0; y < kGrid; ++y, grid += kGridStride) {
      for (int x = 0; x < kRow; ++x) {
        const float u = u_of_row[x] + static_cast<float>(y) * uy;
        const float v = v_of_row[x] + static_cast<float>(y) * vy;
        const auto iu = static_cast<std::int32_t>(u), iv = static_cast<std::int32_t>(v);
        fu[x] = u - static_cast<float>(iu);
        fv[x] = v - static_cast<float>(iv);
        at[x] = iv * side + iu;
      }
#pragma GCC unroll 18
      for (int x = 0; x < kGrid; ++x) {
        const std::uint8_t* p = block + at[x];
        std::memcpy(upper + x, p, 2);
        std::memcpy(lower + x, p + side, 2);
      }
      for (int x = 0; x < kRow; ++x) {
        const std::int32_t p00 = upper[x] & 255, p01 = upper[x] >> 8, p10 = lower[x] & 255, p11 = lower[x] >> 8;
        const float top = static_cast<float>(p00) + static_cast<float>(p01 - p00) * fu[x];
        const float bottom = static_cast<float>(p10) + static_cast<float>(p11 - p10) * fu[x];
        grid[x] = top + (bottom - top) * fv[x];
      }
    }
  }

  /// Of the N columns from the first on; adds to the sums, which are each N lanes.
  template <int N>
  static FBVINS_INLINE void differentiate_columns(const float* grid, const float* w, float* t, float* gx, float* gy,
                                                  Lanes<float, N, B> (&sums)[9]) {
    for (int y = 0; y < kP; ++y, grid += kGridStride, w += kP, t += kP, gx += kP, gy += kP) {
      Lanes<float, N, B> value, left, right, above, below, weight;
      load_lanes(grid + kGridStride + 1, value);
      load_lanes(grid + kGridStride, left);
      load_lanes(grid + kGridStride + 2, right);
      load_lanes(grid + 1, above);
      load_lanes(grid + 2 * kGridStride + 1, below);
      load_lanes(w, weight);
      const Lanes<float, N, B> dx = (right - left) * 0.5f;
      const Lanes<float, N, B> dy = (below - above) * 0.5f;
      store_lanes(value, t);
      store_lanes(dx, gx);
      store_lanes(dy, gy);
      const Lanes<float, N, B> wv = weight * value, wdx = weight * dx, wdy = weight * dy;
      sums[0] += wv;
      sums[1] += wdx;
      sums[2] += wdy;
      sums[3] += wv * value;
      sums[4] += wv * dx;
      sums[5] += wv * dy;
      sums[6] += wdx * dx;
      sums[7] += wdx * dy;
      sums[8] += wdy * dy;
    }
  }

  static FBVINS_INLINE void differentiate(const float* grid, const float* w, float* t, float* gx, float* gy, TemplateMoments& m) {
    // As many columns at once as a register holds, but half of them at least, so that the sums stay in registers.
    constexpr int kColumns = F16::kInPart < kP / 2 ? kP / 2 : F16::kInPart;
    Lanes<float, kColumns, B> sums[kP / kColumns][9] = {};
#pragma GCC unroll 2
    for (int i = 0; i < kP / kColumns; ++i)
      differentiate_columns(grid + i * kColumns, w + i * kColumns, t + i * kColumns, gx + i * kColumns, gy + i * kColumns,
                            sums[i]);
    float sum[9];
#pragma GCC unroll 9
    for (int i = 0; i < 9; ++i) {
      if constexpr (kColumns == kP) sum[i] = sum_lanes(sums[0][i]);
      else sum[i] = sum_lanes(sums[0][i] + sums[1][i]);
    }
    m = {sum[0], sum[1], sum[2], sum[3], sum[4], sum[5], sum[6], sum[7], sum[8]};
  }

  static FBVINS_INLINE void orthogonalise(const float* w, float mean_t, float mean_gx, float mean_gy, float cx, float cy,
                                          float* t, float* gx, float* gy) {
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
};
using Narrow = Kernels<kRegisterBytes>;
using Wide = Kernels<kWideRegisterBytes>;

}  // namespace

FBVINS_KERNEL
void project_patch(const std::uint8_t* p, std::ptrdiff_t stride, float fx, float fy, const float* wgx, const float* wgy,
                   const float* wt, Projections& out) {
  has_wide_registers() ? Wide::project_patch(p, stride, fx, fy, wgx, wgy, wt, out)
                       : Narrow::project_patch(p, stride, fx, fy, wgx, wgy, wt, out);
}

FBVINS_KERNEL
void patch_moments(const std::uint8_t* p, std::ptrdiff_t stride, float fx, float fy, const float* wt, const float* w,
                   PatchMoments& out) {
  has_wide_registers() ? Wide::patch_moments(p, stride, fx, fy, wt, w, out)
                       : Narrow::patch_moments(p, stride, fx, fy, wt, w, out);
}

FBVINS_KERNEL
void pixel_moments(const std::uint8_t* p, std::ptrdiff_t stride, const float* wt, const float* w, PatchMoments& out) {
  has_wide_registers() ? Wide::pixel_moments(p, stride, wt, w, out) : Narrow::pixel_moments(p, stride, wt, w, out);
}

FBVINS_KERNEL
void sample_grid(const std::uint8_t* p, std::ptrdiff_t stride, float fx, float fy, float* grid) {
  has_wide_registers() ? Wide::sample_grid(p, stride, fx, fy, grid) : Narrow::sample_grid(p, stride, fx, fy, grid);
}

FBVINS_KERNEL
void sample_warped(const std::uint8_t* block, int side, float u0, float v0, float ux, float uy, float vx, float vy, float* grid) {
  has_wide_registers() ? Wide::sample_warped(block, side, u0, v0, ux, uy, vx, vy, grid)
                       : Narrow::sample_warped(block, side, u0, v0, ux, uy, vx, vy, grid);
}

FBVINS_KERNEL
void differentiate(const float* grid, const float* w, float* t, float* gx, float* gy, TemplateMoments& m) {
  has_wide_registers() ? Wide::differentiate(grid, w, t, gx, gy, m) : Narrow::differentiate(grid, w, t, gx, gy, m);
}

FBVINS_KERNEL
void orthogonalise(const float* w, float mean_t, float mean_gx, float mean_gy, float cx, float cy, float* t, float* gx,
                   float* gy) {
  has_wide_registers() ? Wide::orthogonalise(w, mean_t, mean_gx, mean_gy, cx, cy, t, gx, gy)
                       : Narrow::orthogonalise(w, mean_t, mean_gx, mean_gy, cx, cy, t, gx, gy);
}

}  // namespace fbvins::klt
