// SPDX-License-Identifier: Apache-2.0
// The inner loops of Lucas-Kanade alignment (klt.hpp) over the samples of a patch, a row at a time. Plain loops over fixed lanes;
// no state. An image patch is given by the address of its first pixel, the distance between rows, and the share (fx, fy) of the
// next pixel in each sample (bilinear); templates and windows are kKltPatch^2 numbers, row by row.
#pragma once

#include <cstddef>
#include <cstdint>

#include "fbvins/features/klt.hpp"

namespace fbvins::klt {

/// Projections of an image patch onto a template's gradients and grey values.
struct Projections {
  float gx, gy, t;
};

/// What a correlation is made of: the projection onto the grey values, and the patch's own first two moments.
struct PatchMoments {
  float t, one, square;
};

void project_patch(const std::uint8_t* p, std::ptrdiff_t stride, float fx, float fy, const float* wgx, const float* wgy,
                   const float* wt, Projections& out);
void patch_moments(const std::uint8_t* p, std::ptrdiff_t stride, float fx, float fy, const float* wt, const float* w,
                   PatchMoments& out);
/// The same of the pixels from p on, nothing interpolated.
void pixel_moments(const std::uint8_t* p, std::ptrdiff_t stride, const float* wt, const float* w, PatchMoments& out);

/// Weighted sums over a patch: of grey values (t), gradients (gx, gy) and their products.
struct TemplateMoments {
  float t, gx, gy, tt, tgx, tgy, gxx, gxy, gyy;
};

/// Template samples with one more on each side, rows kGridStride apart.
inline constexpr int kGrid = kKltPatch + 2;
inline constexpr int kGridStride = 32;

/// Bilinear samples of the image; p is the address of the grid's first sample.
void sample_grid(const std::uint8_t* p, std::ptrdiff_t stride, float fx, float fy, float* grid);
/// Bilinear samples of a square block along a linear map: sample (x, y) lies at (u0 + x ux + y uy, v0 + x vx + y vy).
void sample_warped(const std::uint8_t* block, int side, float u0, float v0, float ux, float uy, float vx, float vy, float* grid);
/// Template and central-difference gradients of a grid, and their moments weighted by w.
void differentiate(const float* grid, const float* w, float* t, float* gx, float* gy, TemplateMoments& m);
/// In place: t - mean, g - mean - c (t - mean), each times the window.
void orthogonalise(const float* w, float mean_t, float mean_gx, float mean_gy, float cx, float cy, float* t, float* gx,
                   float* gy);

}  // namespace fbvins::klt
