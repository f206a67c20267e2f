// SPDX-License-Identifier: Apache-2.0
// Images of a board as a camera would take them, by rays through the exact lens: for tests and the simulator. One thread.
//
//   const BoardCamera renderer(camera, pattern);
//   Image image = renderer.render({T_CnT}, {}, rng);
#pragma once

#include <functional>
#include <vector>

#include "fbvins/calibration/board_pattern.hpp"
#include "fbvins/calibration/board_view.hpp"
#include "fbvins/camera/camera.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

struct BoardImageOptions {
  double black = 25, white = 205;  ///< grey values
  double blur_px = 0.6;            ///< standard deviation, beside the pixel's own area
  double noise = 2;                ///< standard deviation of the grey value
};

class BoardCamera {
 public:
  /// What is behind the board: grey value along a ray in T.
  using Background = std::function<double(const Vec3& origin_T, const Vec3& direction_T)>;

  BoardCamera(const Camera& camera, BoardPattern pattern, Background background = {});

  /// Poses at instants of the exposure: more than one blurs by motion.
  Image render(const std::vector<Pose<Cn, T>>& T_CnT, const BoardImageOptions& options, Rng& rng) const;

 private:
  double grey(const Vec3& origin_T, const Vec3& direction_T, const BoardImageOptions& options) const;

  bool near_board(const Vec3& origin_T, const Mat3& R_TC, const Vec3* above, const Vec3* below) const;

  int width_, height_;
  BoardPattern pattern_;
  Background background_;
  std::vector<Vec3> rays_;  ///< through the corners of the pixels, row by row; zero where the lens has none
};

}  // namespace fbvins
