// SPDX-License-Identifier: Apache-2.0
// Private: the lens of one camera found from nothing but its views, and the choice between lens models. Pure functions.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/board_view.hpp"
#include "fbvins/calibration/detections_file.hpp"
#include "fbvins/camera/camera.hpp"

namespace fbvins {

struct CameraStart {
  Camera camera;
  double rms_px = 0;  ///< robust, of a coordinate
};

/// A table of focal lengths and shapes is tried on views that differ most; the best few are adjusted. nullopt where none fits.
std::optional<CameraStart> start_camera(const std::string& model, const ImageSize& size, const Board& board,
                                        const std::vector<BoardView>& views);

struct ModelChoice {
  std::string model;
  std::vector<std::pair<std::string, double>> held_out_px;  ///< infinite where the model does not fit at all
};

/// Each model is fitted to one half of up to 120 views and judged on the other half, both ways. Of models that predict equally
/// well, to half a per cent, the one with the fewest parameters is taken.
ModelChoice choose_model(const ImageSize& size, const Board& board, const std::vector<BoardView>& views);

}  // namespace fbvins
