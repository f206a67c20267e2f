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

/// Cells of black around the 6 x 6 of a tag's pattern: as libapriltag and OpenCV print tags, and as Kalibr prints an AprilGrid.
inline constexpr int kLibraryBorder = 1, kKalibrBorder = 2;

/// 8 x 8 cells, a border of one cell included, rows from the top; true is black.
using TagCells = std::array<std::array<bool, 8>, 8>;

/// The cells of a tag from 0 to 586.
Result<TagCells> tag_cells(int id);
/// Cells across a tag with such a border.
constexpr int cells_across(int border) { return 6 + 2 * border; }
/// Whether a cell of a tag is black, counted with its border.
bool is_black(const TagCells& cells, int border, int row, int column);

struct TagDetection {
  int id = 0;
  int border = kLibraryBorder;  ///< with which it was read
  int wrong_cells = 0;          ///< of the pattern
  /// Of the black square: bottom left, bottom right, top right, top left of the upright tag; centre of the first pixel at (0, 0).
  std::array<Vec2, 4> corners;
};

/// Of tags that stand alone, with white around, and have a border of one cell; those of a board are another matter
/// (tag_search.hpp). One thread at a time.
class TagDetector {
 public:
  static Result<TagDetector> create();
  TagDetector(TagDetector&&) noexcept;
  TagDetector& operator=(TagDetector&&) noexcept;
  ~TagDetector();

  /// By id; corners to some tenths of a pixel, where the lines along the edges meet.
  std::vector<TagDetection> find(const ImageView& image);

 private:
  struct State;
  explicit TagDetector(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace fbvins
