// SPDX-License-Identifier: Apache-2.0
// Dark squares in an image that may be the tags of a grid, whose corners hang together with those of the squares between them.
// Pure function.
//
//   for (const Quad& square : dark_squares(image, {.reach_px = 12, .smaller_px = 1})) ...
#pragma once

#include <array>
#include <vector>

#include "fbvins/geometry/so3.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// Four corners, in the order of TagDetection for one of its four turns; centre of the first pixel at (0, 0).
using Quad = std::array<Vec2, 4>;

struct DarkSquareOptions {
  int reach_px = 12;   ///< black and white are those of so many pixels around
  int smaller_px = 0;  ///< black parts are looked at smaller by this on each side, 0 or 1: what hangs together comes apart
};

/// Corners to one or two pixels. Those that reach the image's border are left out, and so are those below 8 px.
std::vector<Quad> dark_squares(const ImageView& image, const DarkSquareOptions& options);

}  // namespace fbvins
