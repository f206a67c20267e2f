// SPDX-License-Identifier: Apache-2.0
// Tags of a grid that were not found by themselves, looked for where those beside them say that they are. Pure function.
#pragma once

#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/tag_reading.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// The tags that agree (grid_tags.hpp), and those between and around them whose four corners are crossings of edges and whose
/// cells are those of their number.
std::vector<TagDetection> with_missing_tags(const Board& board, const TagReader& reader, const ImageView& image,
                                            std::vector<TagDetection> tags);

}  // namespace fbvins
