// SPDX-License-Identifier: Apache-2.0
// ORB features (paper 2.2.1): multi-scale FAST with a threshold that adapts to each grid cell, Harris score,
// intensity-centroid orientation, steered BRIEF of 256 bits. Spread over the image by taking each cell's
// best, then each cell's second best, and so on. Buffers are reused; one instance, one thread.
//
//   OrbExtractor extractor(options);
//   OrbFeatures features;
//   extractor.extract(image.view(), features);
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fbvins/features/fast_cells.hpp"
#include "fbvins/features/keypoint.hpp"
#include "fbvins/features/pyramid.hpp"
#include "fbvins/features/scale_pyramid.hpp"

namespace fbvins {

/// Size of a level of the scale pyramid relative to the next.
inline constexpr double kOrbScaleFactor = 1.2;

struct OrbOptions {
  int max_features = 500;  ///< of one image
  int levels = 3;          ///< of the scale pyramid
};

/// Smallest distance of a keypoint from the edges of its level, px.
inline constexpr int kOrbBorder = 12;

class OrbExtractor {
 public:
  /// `margins`: compute Margins as well, which only a stage that changes descriptors needs.
  explicit OrbExtractor(const OrbOptions& options, bool margins = false);

  /// Replaces `out` by the features of the image (none for an empty one), none of them near what its camera's mask hides.
  void extract(const ImageView& image, OrbFeatures& out, const Mask* mask = nullptr);

 private:
  struct Candidate {
    std::int16_t x, y;
    std::int32_t cell;
    float harris;
  };

  void select(const PyramidLevel& level, int quota);
  void take_in_rounds(int quota);
  void describe(int l, OrbFeatures& out);

  OrbOptions options_;
  bool with_margins_;
  std::vector<double> level_share_;
  ScalePyramid pyramid_;
  Pyramid half_;  // of one level
  FastCells fast_;
  std::vector<FastCorner> corners_;
  std::vector<Candidate> candidates_, chosen_;
  std::vector<std::uint8_t> smooth_half_;
  std::vector<std::uint16_t> scratch_;
};

/// Harris response det(M) - 0.04 trace(M)^2 (eq. 2-3) over 8x8 gradients around (x, y); needs 5 px around.
float harris_score(const PyramidLevel& level, int x, int y);

/// Direction of the intensity centroid (eq. 4) of the disc of radius 15 as a unit vector; needs 15 px around.
Vec2 centroid_direction(const PyramidLevel& level, int x, int y);

/// Differences of grey values (second minus first point) of the pairs of orb_pattern().
using Comparisons = std::array<std::int16_t, 256>;

/// Of the pattern (eq. 5) around a pixel of a smoothed level, its x axis turned to `direction`, a unit vector.
Comparisons compare(const PyramidLevel& smooth, const Vec2& pixel, const Vec2& direction);

Descriptor bits_of(const Comparisons& difference);
void margins_of(const Comparisons& difference, std::array<std::int8_t, 256>& margins);

}  // namespace fbvins
