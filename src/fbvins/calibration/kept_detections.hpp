// SPDX-License-Identifier: Apache-2.0
// Private: what an interrupted search for a board has found, in a folder of files that hold some images each and are written
// whole or not at all. Files of other images or another board are no longer of use and are removed. One thread at a time; keep()
// of different parts on any.
//
//   const KeptDetections kept("out/detecting", board, images);
//   ImageFindings known = kept.read();
//   Result<void> done = kept.keep(3, known);          // images 150 to 199
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/detections_file.hpp"
#include "fbvins/io/camera_recording.hpp"

namespace fbvins {

/// What one image gave.
struct ImageFinding {
  BoardView view;
  ImageSize size;
  int tags = 0, foreign_tags = 0, twice = 0;
  bool mirrored = false;
  std::string problem = {};  ///< it could not be read; one line
  bool operator==(const ImageFinding&) const = default;
};

using ImageFindings = std::vector<std::optional<ImageFinding>>;

class KeptDetections {
 public:
  static constexpr std::size_t kImagesOfPart = 50;

  KeptDetections(std::string folder, const Board& board, const std::vector<ListedImage>& images);

  /// One for each listed image. Where there are none, forgets what is in the folder.
  ImageFindings read() const;
  /// All images of the part must be there. Makes the folder.
  Result<void> keep(std::size_t part, const ImageFindings& all) const;
  /// Removes the files, and the folder if it is empty then.
  void forget() const;

 private:
  std::string file_of(std::size_t part) const;
  /// Empty where the file is not there, or is of something else.
  std::vector<ImageFinding> read_part(std::size_t part) const;

  std::string folder_, key_;
  const std::vector<ListedImage>& images_;
};

}  // namespace fbvins
