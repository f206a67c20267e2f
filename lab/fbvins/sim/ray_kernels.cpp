// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/ray_kernels.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "fbvins/core/simd.hpp"
#include "fbvins/sim/texture.hpp"

namespace fbvins::rays {
namespace {

constexpr int kBlock = 16;  ///< rays shaded at a time

}  // namespace

FBVINS_KERNEL void intersect(const float* x, const float* y, const float* m, const float* a, const float* b, int id, Hits& hits) {
  const float m0 = m[0], m1 = m[1], m2 = m[2], a0 = a[0], a1 = a[1], a2 = a[2], b0 = b[0], b1 = b[1], b2 = b[2];
  for (int i = 0; i < kRays; ++i) {
    const float w = m0 * x[i] + m1 * y[i] + m2;
    const float u = a0 * x[i] + a1 * y[i] + a2;
    const float v = b0 * x[i] + b1 * y[i] + b2;
    const bool hit = (w > hits.w[i]) & (u >= 0) & (v >= 0) & (u <= w) & (v <= w);
    hits.w[i] = hit ? w : hits.w[i];
    hits.u[i] = hit ? u : hits.u[i];
    hits.v[i] = hit ? v : hits.v[i];
    hits.id[i] = hit ? id : hits.id[i];
  }
}

FBVINS_KERNEL void shift(const float* ray_x, const float* ray_y, float dx, float dy, float* x, float* y) {
  for (int i = 0; i < kRays; ++i) {
    x[i] = ray_x[i] + dx;
    y[i] = ray_y[i] + dy;
  }
}

FBVINS_KERNEL void divide(Hits& hits, float* depth) {
  for (int i = 0; i < kRays; ++i) {
    const float z = 1.0f / hits.w[i];
    hits.u[i] *= z;
    hits.v[i] *= z;
    depth[i] = hits.id[i] >= 0 ? z : 0.0f;
  }
}

FBVINS_KERNEL void add_spot(const float* x, const float* y, const Hits& hits, int id, const float* towards, float strength,
                            float* sum) {
  const float tx = towards[0], ty = towards[1], tz = towards[2];
  for (int i = 0; i < kRays; ++i) {
    const float c = (tx * x[i] + ty * y[i] + tz) / std::sqrt(x[i] * x[i] + y[i] * y[i] + 1.0f);
    const float distance = 1.0f - 40.0f * (1.0f - c), near = distance > 0 ? distance : 0.0f;
    sum[i] += hits.id[i] == id ? strength * near * near * near : 0.0f;
  }
}

namespace {

/// log2 of a positive number, to 0.01.
inline float rough_log2(float x) {
  const std::int32_t bits = std::bit_cast<std::int32_t>(x);
  const float exponent = static_cast<float>((bits >> 23) - 127);
  const float f = std::bit_cast<float>((bits & 0x7fffff) | 0x3f800000) - 1.0f;
  return exponent + f * (1.3465f - 0.3465f * f);
}

/// Word index and bilinear weights of a look-up at coordinates (s, t), in copies of the texture.
struct Lookup {
  alignas(64) std::int32_t index[kBlock];
  alignas(64) float fx[kBlock];
  alignas(64) float fy[kBlock];
};

inline void locate(float s, float t, std::int32_t level, std::int32_t& index, float& fx, float& fy) {
  const std::int32_t side = kTextureSize >> level, shift = kTextureLevels - 1 - level;
  // 64 copies further on, so that truncation is floor.
  const float x = (s + 64.0f) * static_cast<float>(side) - 0.5f, y = (t + 64.0f) * static_cast<float>(side) - 0.5f;
  const std::int32_t ix = static_cast<std::int32_t>(x), iy = static_cast<std::int32_t>(y);
  fx = x - static_cast<float>(ix);
  fy = y - static_cast<float>(iy);
  const std::int32_t offset = (4 * kTextureSize * kTextureSize - 4 * side * side) / 3;
  index = offset + ((iy & (side - 1)) << shift) + (ix & (side - 1));
}

inline float blend(std::uint32_t word, float fx, float fy) {
  const float p = static_cast<float>(static_cast<std::int32_t>(word & 255u)),
              q = static_cast<float>(static_cast<std::int32_t>(word >> 8 & 255u));
  const float r = static_cast<float>(static_cast<std::int32_t>(word >> 16 & 255u)),
              s = static_cast<float>(static_cast<std::int32_t>(word >> 24));
  const float top = p + fx * (q - p), low = r + fx * (s - r);
  return top + fy * (low - top);
}

FBVINS_KERNEL int count(const Hits& hits, int id) {
  int n = 0;
  for (int i = 0; i < kRays; ++i) n += hits.id[i] == id ? 1 : 0;
  return n;
}

FBVINS_KERNEL void add(const float* radiance, float weight, float* sum) {
  for (int i = 0; i < kBlock; ++i) sum[i] += weight * radiance[i];
}

}  // namespace

void select(const Hits& hits, int id, Lanes& lanes) {
  lanes.count = count(hits, id);
  if (lanes.count == 0) return;
  if (lanes.count == kRays) {
    std::copy_n(hits.w, kRays, lanes.w);
    std::copy_n(hits.u, kRays, lanes.u);
    std::copy_n(hits.v, kRays, lanes.v);
    return;
  }
  int n = 0;
  for (int i = 0; n < lanes.count; ++i) {
    lanes.ray[n] = i;
    n += hits.id[i] == id ? 1 : 0;
  }
  for (int k = 0; k < n; ++k) {
    const int i = lanes.ray[k];
    lanes.w[k] = hits.w[i], lanes.u[k] = hits.u[i], lanes.v[k] = hits.v[i];
  }
  // The last block is padded with the last ray, so that look-ups are valid; their results are not used.
  for (int k = n; k % kBlock != 0; ++k) lanes.w[k] = lanes.w[n - 1], lanes.u[k] = lanes.u[n - 1], lanes.v[k] = lanes.v[n - 1];
}

namespace {

/// Radiance of a block of rays, without weight.
FBVINS_KERNEL void shade_block(const float* w, const float* u, const float* v, const Look& look, float* radiance) {
  Lookup sharp, soft, fine, lit;
  alignas(64) float mix[kBlock], fine_share[kBlock];
  alignas(64) std::uint32_t t0[kBlock], t1[kBlock], d0[kBlock], l0[kBlock];
  constexpr float kCoarsest = kTextureLevels - 2;
  for (int i = 0; i < kBlock; ++i) {
    const float lod = look.lod_constant - 1.5f * rough_log2(w[i]);
    const float level = lod < 0 ? 0.0f : lod > kCoarsest ? kCoarsest : lod;
    const std::int32_t l = static_cast<std::int32_t>(level);
    mix[i] = level - static_cast<float>(l);
    const float s = look.shift_u + look.repeat_u * u[i], t = look.shift_v + look.repeat_v * v[i];
    locate(s, t, l, sharp.index[i], sharp.fx[i], sharp.fy[i]);
    locate(s, t, l + 1, soft.index[i], soft.fx[i], soft.fy[i]);
    const float fine_lod = lod + look.detail_lod;
    const float fine_level = fine_lod < 0 ? 0.0f : fine_lod > 6.0f ? 6.0f : fine_lod;
    const std::int32_t fl = static_cast<std::int32_t>(fine_level);
    // The grain fades out with the level, up to 6, instead of being blended between levels.
    fine_share[i] = look.detail_strength * (fine_level > 5.0f ? 6.0f - fine_level : 1.0f);
    locate(s * look.detail_repeat, t * look.detail_repeat, fl, fine.index[i], fine.fx[i], fine.fy[i]);
    const float cx = u[i] * look.light_x, cy = v[i] * look.light_y;
    std::int32_t ix = static_cast<std::int32_t>(cx), iy = static_cast<std::int32_t>(cy);
    const std::int32_t nx = static_cast<std::int32_t>(look.light_x), ny = static_cast<std::int32_t>(look.light_y);
    ix = ix >= nx ? nx - 1 : ix;
    iy = iy >= ny ? ny - 1 : iy;
    lit.index[i] = iy * nx + ix;
    lit.fx[i] = cx - static_cast<float>(ix);
    lit.fy[i] = cy - static_cast<float>(iy);
  }
  for (int i = 0; i < kBlock; ++i) {
    t0[i] = look.texture[sharp.index[i]];
    t1[i] = look.texture[soft.index[i]];
    d0[i] = look.detail[fine.index[i]];
    l0[i] = look.light[lit.index[i]];
  }
  for (int i = 0; i < kBlock; ++i) {
    const float near = blend(t0[i], sharp.fx[i], sharp.fy[i]), far = blend(t1[i], soft.fx[i], soft.fy[i]);
    const float reflectance = (near + mix[i] * (far - near)) * (1.0f / 255.0f);
    const float grain = 1.0f + fine_share[i] * (blend(d0[i], fine.fx[i], fine.fy[i]) * (2.0f / 255.0f) - 1.0f);
    const float light = blend(l0[i], lit.fx[i], lit.fy[i]) * (1.0f / 255.0f);
    radiance[i] = reflectance * grain * light * look.brightness + look.emission;
  }
}

}  // namespace

void shade(const Lanes& lanes, const Look& look, float weight, float* sum) {
  for (int first = 0; first < lanes.count; first += kBlock) {
    alignas(64) float radiance[kBlock];
    shade_block(lanes.w + first, lanes.u + first, lanes.v + first, look, radiance);
    if (lanes.count == kRays) add(radiance, weight, sum + first);
    else
      for (int k = first; k < lanes.count && k < first + kBlock; ++k) sum[lanes.ray[k]] += weight * radiance[k - first];
  }
}

}  // namespace fbvins::rays
