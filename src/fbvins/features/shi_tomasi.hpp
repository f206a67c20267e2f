// SPDX-License-Identifier: Apache-2.0
// Shi-Tomasi corners (Good Features to Track, CVPR 1994), kept apart and spread over a grid of cells.
// Responses are computed only in cells that still need a feature. The threshold follows the image's own noise,
// so that dim and weakly textured cells deliver as long as their best corner stands out of the noise.
// Buffers are reused; not thread-safe.
//
//   ShiTomasiDetector detector(options);
//   const std::vector<Corner>& fresh = detector.detect(pyramid, tracked_px, 150 - tracked_px.size());
#pragma once

#include <span>
#include <vector>

#include "fbvins/features/pyramid.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {

struct Corner {
  Vec2 px = Vec2::Zero();  ///< level-0 pixels, sub-pixel
  float response = 0;      ///< smaller eigenvalue of the mean structure tensor, (grey/px)^2
};

struct ShiTomasiOptions {
  int cell_px = 44;
  double min_distance_px = 22;
  double noise_factor = 5.0;
  double min_response = 0.4;
  int border_px = 10;

  template <class V>
  void visit(V&& v) {
    v("cell_px", cell_px, "px", "side of a grid cell; a cell without a feature is searched first", 16, 256);
    v("min_distance_px", min_distance_px, "px", "smallest distance between features", 4.0, 200.0);
    v("noise_factor", noise_factor, "", "a corner's response is at least this times that of image noise", 0.0, 100.0);
    v("min_response", min_response, "grey^2", "smallest response of a corner in a noiseless image", 0.0, 1000.0);
    v("border_px", border_px, "px", "no corner is nearer to the image's edge", 8, 100);
  }
};

/// Standard deviation of the pixel noise, grey values: median response to a mask that is blind to planes
/// and straight edges (Immerkaer 1996), on a sparse grid.
double estimate_noise(const PyramidLevel& image);

class ShiTomasiDetector {
 public:
  explicit ShiTomasiDetector(const ShiTomasiOptions& options) : options_(options) {}

  /// At most `wanted` new corners of level 0: first the best of each empty cell, then their next best, then
  /// what occupied cells have beside. None is nearer than min_distance_px (two thirds of it for the last
  /// kind) to another or to `existing`. Looks into a limited number of cells, in turn from call to call.
  /// Valid until the next call.
  const std::vector<Corner>& detect(const Pyramid& pyramid, std::span<const Vec2> existing, int wanted);
  /// The noise estimate of the last detect(), grey values.
  double noise() const { return noise_; }

 private:
  void search_cell(const PyramidLevel& image, int column, int row, float threshold);
  void search_cells(const PyramidLevel& image, int columns, bool empty, float threshold, std::span<const Vec2> existing,
                    int wanted);
  bool far_from_all(const Vec2& px, std::span<const Vec2> existing, double distance_px) const;
  void accept(std::vector<Corner>& candidates, std::span<const Vec2> existing, double distance_px, int wanted);

  ShiTomasiOptions options_;
  double noise_ = 0;
  int next_cell_[2] = {-1, -1};        // where the searches of empty and of occupied cells stopped
  std::vector<Corner> corners_;        // accepted
  std::vector<Corner> cell_corners_;   // of the cell being searched
  std::vector<Corner> best_, others_;  // candidates of the frame
  std::vector<int> occupancy_;         // features in each cell
  std::vector<float> response_;        // of the cell being searched, with one pixel around
  std::vector<std::int32_t> tensors_;  // rows of structure tensors and their running sums
};

}  // namespace fbvins
