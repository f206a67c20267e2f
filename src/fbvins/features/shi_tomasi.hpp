// SPDX-License-Identifier: Apache-2.0
// Shi-Tomasi corners (Good Features to Track, CVPR 1994), kept apart and spread over a grid of cells.
// Responses are computed only in cells that still need a feature. The threshold follows the image's own noise,
// so that dim and weakly textured cells give corners as long as the best one exceeds the noise.
// Buffers are reused; not thread-safe.
//
//   ShiTomasiDetector detector(22);
//   const std::vector<Corner>& fresh = detector.detect(pyramid, tracked_px, 150 - tracked_px.size());
#pragma once

#include <span>
#include <vector>

#include "fbvins/camera/mask.hpp"
#include "fbvins/features/pyramid.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {

struct Corner {
  Vec2 px = Vec2::Zero();  ///< level-0 pixels, sub-pixel
  float response = 0;      ///< smaller eigenvalue of the mean structure tensor, (grey/px)^2
};

/// Standard deviation of the pixel noise, grey values: lower quartile of the response to a mask that is blind to planes
/// and straight edges (Immerkaer 1996), on a sparse grid.
double estimate_noise(const PyramidLevel& image);

class ShiTomasiDetector {
 public:
  static constexpr int kFewestCells = 24;  ///< searched each time, if as many are empty and corners are wanted

  /// `min_distance_px`: between features; cells, each of which is to have one, have twice that side. `cells_per_corner`: searched
  /// for each corner that is wanted, where that is less than otherwise.
  explicit ShiTomasiDetector(double min_distance_px, int cells_per_corner = kFewestCells)
      : min_distance_px_(min_distance_px), cell_px_(static_cast<int>(2 * min_distance_px)), cells_per_corner_(cells_per_corner) {}

  int cell_px() const { return cell_px_; }

  /// At most `wanted` new corners of level 0: first the best of each empty cell, then their next best, then
  /// what occupied cells have beside. None is nearer than min_distance_px (two thirds of it for the last
  /// kind) to another or to `existing`, nor near what the mask hides. Looks into a limited number of cells, in turn from call to
  /// call.
  /// A mask that is given must live as long as the detector: its hidden cells are found once.
  /// Valid until the next call, so a detector that ends with the expression cannot be asked.
  const std::vector<Corner>& detect(const Pyramid& pyramid, std::span<const Vec2> existing, int wanted,
                                    const Mask* mask = nullptr) &;
  /// The noise estimate of the last detect(), grey values.
  double noise() const { return noise_; }

 private:
  void find_hidden_cells(const Mask& mask, int columns, int rows);
  void search_cell(const PyramidLevel& image, int column, int row, float threshold, const Mask* mask);
  void search_cells(const PyramidLevel& image, int columns, bool empty, float threshold, std::span<const Vec2> existing,
                    int wanted, const Mask* mask);
  bool far_from_all(const Vec2& px, std::span<const Vec2> existing, double distance_px) const;
  void accept(std::vector<Corner>& candidates, std::span<const Vec2> existing, double distance_px, int wanted);

  double min_distance_px_;
  int cell_px_;
  int cells_per_corner_;
  double noise_ = 0;
  int next_cell_[2] = {-1, -1};        // where the searches of empty and of occupied cells stopped
  std::vector<Corner> corners_;        // accepted
  std::vector<Corner> cell_corners_;   // of the cell being searched
  std::vector<Corner> best_, others_;  // candidates of the frame
  std::vector<int> occupancy_;         // features in each cell, or kHidden
  const Mask* hidden_by_ = nullptr;    // the mask of hidden_cells_
  std::vector<bool> hidden_cells_;     // of which it leaves nothing
  std::vector<float> response_;        // of the cell being searched, with one pixel around
  std::vector<std::int32_t> tensors_;  // rows of structure tensors and their running sums
};

}  // namespace fbvins
