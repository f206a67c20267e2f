// SPDX-License-Identifier: Apache-2.0
// How to hold the board next, by information: of the ways in which it could be held, the one whose images would make known best
// what is known worst, each part measured by its aim. Pure functions, any thread.
//
//   const NextView next = next_view(knowledge_of(found), board, holds, {});
//   print(next.sentence);                     // "tilt the board about its horizontal axis, its upper edge towards cam0"
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fbvins/calibration/rig_knowledge.hpp"
#include "fbvins/calibration/weak_parts.hpp"

namespace fbvins {

/// How a board is held before a camera.
struct BoardHold {
  int camera = 0;
  int place = 4;          ///< ninth of the image where the board's middle is, row by row from the top left
  double fill = 0.5;      ///< the board's width, were it not tilted, as a part of the image's
  double tilt_x_rad = 0;  ///< about a horizontal axis; positive: its upper edge is nearer
  double tilt_y_rad = 0;  ///< about a vertical axis; positive: its right edge is nearer, in the image
};

/// By the lens as it is known; nullopt where too few corners are seen.
std::optional<BoardHold> hold_of(const Camera& camera, const Board& board, const BoardView& view);

/// The other way round: where a board is that is held so. nullopt where the lens has no ray.
std::optional<Pose<Cn, T>> pose_of(const Camera& camera, const Board& board, const BoardHold& hold);

enum class HoldChange { camera, place, distance, tilt };

struct NextView {
  BoardHold hold;
  HoldChange change = HoldChange::camera;  ///< what the sentence asks for
  std::string sentence;
  double gain = 0;  ///< by which factor what is known worst gets better, in squares; 1: not at all
};

/// Whether the board is held as was asked, in what the sentence was about.
bool followed(const NextView& asked, const std::vector<BoardHold>& now);

/// `now`: how those cameras that see the board at this moment see it; the sentence says what to change about one of these, or
/// which camera to show the board.
NextView next_view(const RigKnowledge& known, const Board& board, const std::vector<BoardHold>& now, const CertaintyAims& aims);

}  // namespace fbvins
