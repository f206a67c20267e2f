// SPDX-License-Identifier: Apache-2.0
// What one camera sees of a board in one image: the value between detection and calibration.
#pragma once

#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// Any camera of a rig: z forward, x right, y down.
struct Cn {};

struct BoardCorner {
  int index = 0;              ///< Board::corner
  Vec2 pixel = Vec2::Zero();  ///< raw image, centre of the top-left pixel at (0, 0)
  bool operator==(const BoardCorner&) const = default;
};

struct BoardView {
  Time t;          ///< the image's stamp, camera's clock
  int camera = 0;  ///< 0: cam0
  std::vector<BoardCorner> corners;
  bool operator==(const BoardView&) const = default;
};

}  // namespace fbvins
