// SPDX-License-Identifier: Apache-2.0
// Boards as Kalibr's target files describe them. Pure functions.
//
//   Result<Board> board = load_target("april.yaml");
//
// target_type aprilgrid:    tagCols, tagRows, tagSize (m), tagSpacing (gap between tags as a part of tagSize)
// target_type checkerboard: targetCols, targetRows (inner corners), colSpacingMeters, rowSpacingMeters
// target_type charuco:      squareCols, squareRows, squareSize (m), markerSize (m); of this project, Kalibr has none
#pragma once

#include <string>

#include "fbvins/calibration/board.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

/// Tags of the family tag36h11, which both AprilGrid and ChArUco use.
inline constexpr int kTagsOfFamily = 587;

Result<Board> load_target(const std::string& path);
/// `file` is only for messages.
Result<Board> parse_target(const std::string& text, const std::string& file);
std::string target_to_yaml(const Board& board);
/// A sentence about the first number that no board has; empty if all are possible.
std::string impossible(const Board& board);

}  // namespace fbvins
