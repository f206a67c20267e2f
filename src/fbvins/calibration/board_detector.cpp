// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/board_detector.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "fbvins/calibration/corner_refine.hpp"

namespace fbvins {
namespace {

// A tag's border is an eighth of it wide: below this it is less than two pixels.
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
  Result<TagDetector> detector = TagDetector::create();
  if (!detector) return detector.error();
  return BoardDetector(board, *std::move(detector));
}

BoardDetection BoardDetector::find(const ImageView& image) {
  BoardDetection out;
  const std::vector<TagDetection> tags = detector_.find(image, board_.columns * board_.rows / 2);
  for (std::size_t i = 0; i < tags.size(); ++i) {
    const TagDetection& tag = tags[i];
    if (tag.id >= board_.columns * board_.rows) {
      ++out.foreign_tags;
      continue;
    }
    if ((i > 0 && tags[i - 1].id == tag.id) || (i + 1 < tags.size() && tags[i + 1].id == tag.id)) {
      out.twice += i == 0 || tags[i - 1].id != tag.id;
      continue;
    }
    ++out.tags;
    const double side_px = shortest_side_px(tag);
    if (side_px < kSmallestTag_px) continue;
    // No other edge within: the border's inner one is an eighth of the tag away, the square's between the tags its own width.
    const double radius_px = std::clamp(side_px * std::min(0.125, board_.spacing), 2.0, kLargestRadius_px);
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
  return detector_.find(mirrored.view(), 3).size() >= 3;
}

}  // namespace fbvins
