// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/board_detector.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "fbvins/calibration/corner_refine.hpp"
#include "fbvins/calibration/grid_fill.hpp"
#include "fbvins/calibration/grid_tags.hpp"
#include "fbvins/calibration/tag_search.hpp"

namespace fbvins {
namespace {

// The border of a tag, an eighth or a fifth of it, is less than two or three pixels wide below this.
constexpr double kSmallestTag_px = 16;
constexpr double kLargestRadius_px = 6;

double shortest_side_px(const TagDetection& tag) {
  double shortest = 1e9;
  for (int k = 0; k < 4; ++k) shortest = std::min(shortest, (tag.corners[k] - tag.corners[(k + 1) % 4]).norm());
  return shortest;
}

}  // namespace

Result<BoardDetector> BoardDetector::create(const Board& board) {
  if (board.kind != BoardKind::aprilgrid)
    return Error{
        ErrorCode::unsupported,
        fmt::format("only AprilGrids are found in images: record one that `fbvins target` prints, or give the corners of this "
                    "{} by --detections",
                    board.kind == BoardKind::charuco ? "ChArUco board" : "chessboard")};
  if (const Result<TagCells> last = tag_cells(board.columns * board.rows - 1); !last) return last.error();
  Result<TagReader> reader = TagReader::create(board.spacing);
  if (!reader) return reader.error();
  return BoardDetector(board, *std::move(reader));
}

BoardDetection BoardDetector::find(const ImageView& image) {
  BoardDetection out;
  GridTags seen = tags_of_grid(board_, search_tags(image, reader_, board_.columns * board_.rows));
  if (seen.twice == 0) seen.tags = with_missing_tags(board_, reader_, image, std::move(seen.tags));
  out.tags = static_cast<int>(seen.tags.size());
  out.foreign_tags = seen.foreign;
  out.twice = seen.twice;
  for (const TagDetection& tag : seen.tags) {
    const double side_px = shortest_side_px(tag);
    if (side_px < kSmallestTag_px) continue;
    // The search must not reach another edge: the border's inner edge is one border width away, that of the squares between the
    // tags its own width.
    const double border = static_cast<double>(tag.border) / cells_across(tag.border);
    const double radius_px = std::clamp(side_px * std::min(border, board_.spacing), 2.0, kLargestRadius_px);
    for (int k = 0; k < 4; ++k)
      if (const auto corner = refine_corner(image, tag.corners[k], tag.corners[(k + 1) % 4] - tag.corners[k],
                                            tag.corners[(k + 3) % 4] - tag.corners[k], radius_px))
        out.corners.push_back({4 * tag.id + k, *corner});
  }
  return out;
}

bool BoardDetector::finds_mirrored(const ImageView& image) {
  Image mirrored(image.width, image.height);
  for (int y = 0; y < image.height; ++y) std::reverse_copy(image.row(y), image.row(y) + image.width, mirrored.row(y));
  const GridTags seen = tags_of_grid(board_, search_tags(mirrored.view(), reader_, 3));
  return static_cast<int>(seen.tags.size()) + seen.foreign >= 3;
}

}  // namespace fbvins
