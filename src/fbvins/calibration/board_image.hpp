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

  /// Poses at instants of an exposure.
  using Instants = std::vector<Pose<Cn, T>>;

  /// More than one instant blurs by motion.
  Image render(const Instants& T_CnT, const BoardImageOptions& options, Rng& rng) const;
  /// The same by a rolling shutter, which exposes each row at its own instants: as many for every row.
  Image render(const std::function<Instants(int row)>& T_CnT_of_row, const BoardImageOptions& options, Rng& rng) const;

 private:
  /// Where a row's instants are, and how they look, in the board's frame.
  struct Eyes {
    explicit Eyes(const Instants& T_CnT);
    std::vector<Vec3> origins;
    std::vector<Mat3> rotations;
  };
  void light_of_row(int y, const Eyes& eyes, const BoardImageOptions& options, double* light) const;
  Image exposed(std::vector<double> light, const BoardImageOptions& options, Rng& rng) const;
  double grey(const Vec3& origin_T, const Vec3& direction_T, const BoardImageOptions& options) const;

  bool near_board(const Vec3& origin_T, const Mat3& R_TC, const Vec3* above, const Vec3* below) const;

  int width_, height_;
  BoardPattern pattern_;
  Background background_;
  std::vector<Vec3> rays_;  ///< through the corners of the pixels, row by row; zero where the lens has none
};

}  // namespace fbvins
