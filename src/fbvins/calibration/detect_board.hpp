// SPDX-License-Identifier: Apache-2.0
// A board looked for in all images of a recording, on several threads; the result does not depend on their number.
//
//   Result<BoardSearch> found = detect_board(board, recording, {.threads = 2, .keep = "out/detecting"});
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/detections_file.hpp"
#include "fbvins/io/camera_recording.hpp"

namespace fbvins {

struct BoardSearchOptions {
  int threads = 2;
  /// A folder for what was found so far: a search that was interrupted goes on from there and finds the same to the bit. It stays
  /// until forget_kept_detections(). Empty: nothing is kept.
  std::string keep = {};
  std::function<void(int images_done)> progress = {};  ///< called by one thread at a time
  std::function<void(int images)> resumed = {};        ///< called first, where so many are known from an interrupted search
  std::function<bool()> stop = {};                     ///< asked on any thread; true: end early
};

struct BoardSearch {
  int stopped_after = -1;  ///< images, where options.stop ended the search: nothing else is given then
  Detections detections;
  std::vector<int> images;  ///< of each camera, those that could be read
  int unreadable = 0;
  std::string first_unreadable;  ///< name and sentence
};

/// An error, one sentence, where no image shows the board (and why: mirrored, other tags, none), two boards are in view, a
/// camera's images differ in size, or nothing can be kept in the folder.
Result<BoardSearch> detect_board(const Board& board, const CameraRecording& recording, const BoardSearchOptions& options);

/// Removes what is kept in the folder, and the folder if it is empty then.
void forget_kept_detections(const std::string& folder);

}  // namespace fbvins
