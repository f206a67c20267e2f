// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/booster_kernels.hpp"

#include <cmath>
#include <cstring>

#include "fbvins/core/simd.hpp"
#include "fbvins/features/lanes.hpp"

namespace fbvins {
namespace {

/// In an array: GCC 12 compares the lanes of a vector wider than a register one by one.
FBVINS_INLINE void at_least(float lowest, F16& x) {
  float lanes[kLanes];
  store_lanes(x, lanes);
  for (float& lane : lanes) lane = lane < lowest ? lowest : lane;
  load_lanes(lanes, x);
}

/// e^x for x <= 0 to about 2e-7 of its value; below -87 the smallest normal number or so.
FBVINS_INLINE void exp_of_negative(F16& x) {
  at_least(-87.0f, x);
  constexpr float kRounder = 12582912.0f;
  const F16 whole = (x * 1.44269504f + kRounder) - kRounder;
  const F16 r = (x - whole * 0.693359375f) + whole * 2.12194440e-4f;  // ln 2 in two parts
  F16 p = F16{} + 1.9875691500e-4f;
  p = p * r + 1.3981999507e-3f;
  p = p * r + 8.3334519073e-3f;
  p = p * r + 4.1665795894e-2f;
  p = p * r + 1.6666665459e-1f;
  p = p * r + 5.0000001201e-1f;
  p = p * r * r + r + 1.0f;
  F16 power;
#pragma GCC unroll 4
  for (int i = 0; i < F16::kParts; ++i) {
    using Whole = Lanes<std::int32_t, F16::kInPart>::Part;
    const Whole exponent = (__builtin_convertvector(whole.part[i], Whole) + 127) << 23;
    std::memcpy(&power.part[i], &exponent, sizeof(exponent));
  }
  x = p * power;
}

}  // namespace

FBVINS_KERNEL
void multiply_float(const float* x, int rows, int inputs, const float* weight_t, const float* bias, int outputs, float* out) {
  for (int row = 0; row < rows; ++row) {
    float* o = out + static_cast<std::ptrdiff_t>(row) * outputs;
    for (int n = 0; n < outputs; n += kLanes) {
      F16 sum, w;
      load_lanes(bias + n, sum);
      for (int k = 0; k < inputs; ++k) {
        load_lanes(weight_t + static_cast<std::ptrdiff_t>(k) * outputs + n, w);
        sum += w * x[static_cast<std::ptrdiff_t>(row) * inputs + k];
      }
      store_lanes(sum, o + n);
    }
  }
}

FBVINS_KERNEL
void relu(float* x, int n) {
  for (int i = 0; i < n; ++i) x[i] = x[i] > 0 ? x[i] : 0.0f;
}

FBVINS_KERNEL
void add(float* x, const float* y, int n) {
  for (int i = 0; i < n; ++i) x[i] += y[i];
}

FBVINS_KERNEL
void normalise_rows(float* x, int rows, int width, const float* weight, const float* bias) {
  for (int row = 0; row < rows; ++row) {
    float* r = x + static_cast<std::ptrdiff_t>(row) * width;
    F16 sum{}, squares{}, v, w, b;
    for (int c = 0; c < width; c += kLanes) {
      load_lanes(r + c, v);
      sum += v;
    }
    const float mean = sum_lanes(sum) / static_cast<float>(width);
    for (int c = 0; c < width; c += kLanes) {
      load_lanes(r + c, v);
      squares += (v - mean) * (v - mean);
    }
    const float factor = 1.0f / std::sqrt(sum_lanes(squares) / static_cast<float>(width) + 1e-5f);
    for (int c = 0; c < width; c += kLanes) {
      load_lanes(r + c, v);
      load_lanes(weight + c, w);
      load_lanes(bias + c, b);
      store_lanes((v - mean) * factor * w + b, r + c);
    }
  }
}

FBVINS_KERNEL
void summarise(float* key, const float* value, int rows, int width, float* summary, float* scratch) {
  float *most = scratch, *total = scratch + width;
  for (int c = 0; c < width; ++c) most[c] = -1e30f, total[c] = 0, summary[c] = 0;
  for (int row = 0; row < rows; ++row)
    for (int c = 0; c < width; ++c) {
      const float k = key[static_cast<std::ptrdiff_t>(row) * width + c];
      most[c] = k > most[c] ? k : most[c];
    }
  for (int row = 0; row < rows; ++row)
    for (int c = 0; c < width; c += kLanes) {
      F16 k, v, m, t, s;
      load_lanes(key + static_cast<std::ptrdiff_t>(row) * width + c, k);
      load_lanes(value + static_cast<std::ptrdiff_t>(row) * width + c, v);
      load_lanes(most + c, m);
      load_lanes(total + c, t);
      load_lanes(summary + c, s);
      k -= m;
      exp_of_negative(k);
      store_lanes(t + k, total + c);
      store_lanes(s + k * v, summary + c);
    }
  for (int c = 0; c < width; ++c) summary[c] /= total[c] > 0 ? total[c] : 1.0f;
}

FBVINS_KERNEL
void gate(const float* query, const float* summary, int rows, int width, float* out) {
  for (int row = 0; row < rows; ++row)
    for (int c = 0; c < width; c += kLanes) {
      F16 q, s;
      load_lanes(query + static_cast<std::ptrdiff_t>(row) * width + c, q);
      load_lanes(summary + c, s);
      // exp of minus the magnitude cannot overflow
      float of[kLanes], lanes[kLanes];
      store_lanes(q, of);
      for (int l = 0; l < kLanes; ++l) lanes[l] = of[l] > 0 ? -of[l] : of[l];
      F16 e;
      load_lanes(lanes, e);
      exp_of_negative(e);
      const F16 larger = 1.0f / (1.0f + e), smaller = 1.0f - larger;
      float either[2][kLanes];
      store_lanes(larger, either[0]);
      store_lanes(smaller, either[1]);
      for (int l = 0; l < kLanes; ++l) lanes[l] = of[l] > 0 ? either[0][l] : either[1][l];
      F16 share;
      load_lanes(lanes, share);
      store_lanes(share * s, out + static_cast<std::ptrdiff_t>(row) * width + c);
    }
}

FBVINS_KERNEL
void take_signs(const float* y, std::uint64_t* out) {
  std::uint8_t positive[256];
  for (int i = 0; i < 256; ++i) positive[i] = y[i] > 0;
  pack_flags(positive, out);
}

}  // namespace fbvins
