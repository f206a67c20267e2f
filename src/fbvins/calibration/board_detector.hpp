// SPDX-License-Identifier: Apache-2.0
// The corners of a board in an image. One thread a detector.
//
//   Result<BoardDetector> detector = BoardDetector::create(board);
//   BoardDetection seen = detector->find(image.view());
#pragma once

#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/board_view.hpp"
#include "fbvins/calibration/tag_reading.hpp"

namespace fbvins {

struct BoardDetection {
  std::vector<BoardCorner> corners;  ///< by index
  int tags = 0;                      ///< of the board
  int foreign_tags = 0;              ///< with a number that the board does not have
  int twice = 0;                     ///< numbers that are there more than once: left out
};

class BoardDetector {
 public:
  /// An error where the kind of board cannot be found in images.
  static Result<BoardDetector> create(const Board& board);

  BoardDetection find(const ImageView& image);
  /// Whether tags are found in the mirrored image: printed mirrored, or a mirrored image.
  bool finds_mirrored(const ImageView& image);

 private:
  BoardDetector(const Board& board, TagReader reader) : board_(board), reader_(std::move(reader)) {}

  Board board_;
  TagReader reader_;
};

}  // namespace fbvins
