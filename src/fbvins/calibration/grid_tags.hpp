// SPDX-License-Identifier: Apache-2.0
// Which of the tags found in an image are those of an AprilGrid: that lie to one another as their numbers say. Pure function.
//
//   GridTags seen = tags_of_grid(board, search_tags(image, reader, 36));
#pragma once

#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/tag_family.hpp"

namespace fbvins {

struct GridTags {
  std::vector<TagDetection> tags;  ///< by id, each once, all of one border
  int foreign = 0;                 ///< with a number that the board does not have
  int twice = 0;                   ///< numbers that are there more than once: left out
};

/// Of the borders the one is taken with which more tags agree. A tag that agrees with no other was read by luck and is left out,
/// unless the board has no other; where most tags do not lie as the board's (swapped columns and rows, another spacing), all that
/// were read without a wrong cell are kept, for who can say what is wrong.
GridTags tags_of_grid(const Board& board, const std::vector<TagDetection>& found);

}  // namespace fbvins
