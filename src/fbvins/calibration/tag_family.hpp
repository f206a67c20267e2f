// SPDX-License-Identifier: Apache-2.0
// The tags of AprilGrid and ChArUco (tag36h11) as libapriltag knows them: their patterns, and finding them in images. A build
// without that library has neither, and says so.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/geometry/so3.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// 8 x 8 cells, border included, rows from the top; true is black.
using TagCells = std::array<std::array<bool, 8>, 8>;

/// The cells of a tag from 0 to 586.
Result<TagCells> tag_cells(int id);

struct TagDetection {
  int id = 0;
  /// Of the black square: bottom left, bottom right, top right, top left of the upright tag; centre of the first pixel at (0, 0).
  std::array<Vec2, 4> corners;
};

/// One thread at a time.
class TagDetector {
 public:
  static Result<TagDetector> create();
  TagDetector(TagDetector&&) noexcept;
  TagDetector& operator=(TagDetector&&) noexcept;
  ~TagDetector();

  /// By id; corners to about a pixel. Where fewer than `enough` are found in one way, another one is tried.
  std::vector<TagDetection> find(const ImageView& image, int enough);
  /// The same of tags that stand alone, with white around: corners to some tenths of a pixel, where the lines along the edges
  /// meet.
  std::vector<TagDetection> find_alone(const ImageView& image);

 private:
  struct State;
  explicit TagDetector(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace fbvins
