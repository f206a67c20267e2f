// SPDX-License-Identifier: Apache-2.0
// Private: what calibrate_cameras() refuses, each with one sentence that says what to do. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "fbvins/calibration/camera_calibration.hpp"
#include "fbvins/calibration/camera_chain.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

bool enough_corners(const BoardView& view, const Board& board);
/// The smallest usual size of images that holds all corners.
ImageSize smallest_usual_size(const std::vector<BoardView>& views);
/// Beyond this the board or the lens is another one.
double largest_plausible_rms_px(const ImageSize& size);

Result<void> check_input(const Detections& detections, const Board& board, const CameraCalibrationOptions& options);
/// The error where no lens of the model fits: what else would fit is looked for.
Error no_start(int camera, const Board& board, const ImageSize& size, const std::vector<BoardView>& views);
/// Whether the board is seen mirrored, by all cameras alike.
Result<bool> check_poses(const std::vector<PosedView>& posed, int cameras);
/// `views`: of cam0, in which another layout of the board is looked for where the fit is poor.
Result<void> check_fit(double noise_px, double single_px, const ImageSize& size, int cameras, const Board& board,
                       const std::vector<BoardView>& views);
Error undetermined(const std::string& what);
Result<void> check_determined(const CameraCalibration& found);
/// No camera is there twice.
Result<void> check_places(const CameraCalibration& found);
std::vector<std::string> remarks_on(const CameraCalibration& found);

}  // namespace fbvins
