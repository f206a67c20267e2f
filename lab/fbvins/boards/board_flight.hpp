// SPDX-License-Identifier: Apache-2.0
// A rendered recording of a calibration board with exact truth, as an EuRoC folder. One thread calls; the same options give the
// same bytes.
//
//   Result<void> done = simulate_board({.seconds = 30}, "board", [](int done, int all) { ... });
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fbvins/boards/board_motion.hpp"
#include "fbvins/calibration/board.hpp"
#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

struct BoardFlightOptions {
  Board board;
  std::string lens = "pinhole-radtan";  ///< as Camera::model_name() names it
  int cameras = 2;                      ///< 1 to 4, of slightly different numbers; the first two are the pair
  double seconds = 60;
  double image_rate_hz = 20;
  double exposure_ms = 2;     ///< blurs by motion
  double blur_px = 0.6;       ///< of the lens, standard deviation
  double noise = 2;           ///< of a grey value, standard deviation
  double time_offset_ms = 5;  ///< stamp of the IMU less that of the image at the same instant
  double later_ms = 0;        ///< so much later than the one before it each camera takes its image, which has the same stamp
  double line_delay_us = 0;   ///< from row to row of a rolling shutter; the image's stamp is its middle row's
  double imu_scale = 0;       ///< standard deviation of each axis' scale of the IMU, 0.01 is 1 %
  double imu_axes_deg = 0;    ///< of each axis' direction
  int seed = 1;
  std::vector<int> missing_tags = {};  ///< places of the board that stay white
  HandMotion motion = {};              ///< for recordings that do not determine a calibration
};

/// The rig that takes the images: what a calibration should find.
Result<StereoRig> board_flight_rig(const BoardFlightOptions& options);

/// Writes folder/mav0 with the true calibration in its sensor.yaml files, and target.yaml beside it.
Result<void> simulate_board(const BoardFlightOptions& options, const std::string& folder,
                            const std::function<void(int done, int all)>& progress);

}  // namespace fbvins
