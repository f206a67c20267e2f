// SPDX-License-Identifier: Apache-2.0
// FAST-9 corners (paper eq. 1) with their exact strength: the largest threshold at which the pixel still is
// a corner. With it at hand, lowering a cell's threshold until it has its quota is the same as taking
// the strongest corners of the cell (fast_cells.hpp). Functions without state; buffers belong to the caller. What they read must
// be readable 32 px beyond the end of each row (padding, next row).
#pragma once

#include <cstddef>
#include <cstdint>

namespace fbvins {

struct FastCorner {
  std::int16_t x = 0, y = 0;  ///< px of the level
  std::uint8_t strength = 0;  ///< corner at every threshold below this
};

/// Pixels whose strengths are computed at a time.
inline constexpr int kFastBlock = 32;

/// strength[x] for `count` pixels of a row from `centre` on; writes up to the next multiple of kFastBlock.
/// Strength: over all arcs of 9 of the 16 circle pixels, the largest smallest difference to the centre.
/// `found` of each block of kFastBlock pixels: whether one exceeds its limit.
void fast_strength_row(const std::uint8_t* centre, std::ptrdiff_t stride, int count, const std::uint8_t* limits,
                       std::uint8_t* strength, std::uint8_t* found);

/// Strengths of a row that beat their 3x3 neighbourhood and their column's limit, 0 elsewhere; of equal ones the first in reading
/// order stays. Reads a pixel beyond both ends, and leaves alone the blocks that are not `found`.
void keep_local_maxima(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below, int count,
                       const std::uint8_t* limits, const std::uint8_t* found, std::uint8_t* kept);

}  // namespace fbvins
