// SPDX-License-Identifier: Apache-2.0
// A board looked for in all images of a recording, on several threads; the result does not depend on their number.
//
//   const auto next = [&] { return recording.next(); };
//   Result<BoardSearch> found = detect_board(board, next, {.threads = 2});
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/board_recording.hpp"
#include "fbvins/calibration/detections_file.hpp"

namespace fbvins {

struct BoardSearchOptions {
  int threads = 2;
  std::function<void(int images_done)> progress = {};  ///< called by one thread at a time
};

struct BoardSearch {
  Detections detections;
  std::vector<int> images;  ///< of each camera, those that could be read
  int unreadable = 0;
  std::string first_unreadable;  ///< name and sentence
};

/// `next` is called by one thread at a time until it gives nothing. An error, one sentence, where no image shows the board (and
/// why: mirrored, other tags, none), two boards are in view, or a camera's images differ in size.
Result<BoardSearch> detect_board(const Board& board, const std::function<std::optional<TakenImage>()>& next,
                                 const BoardSearchOptions& options);

}  // namespace fbvins
