// SPDX-License-Identifier: Apache-2.0
// What the tracks of two images say of a turn that the gyroscope's readings predict, without depth or scale: by how much it and
// the line delay of the shutter are off (docs/derivations/gyro_alignment.md, Y1-Y4). Pure functions, any thread.
//
//   TurnError error = turn_error(tracks, predicted, {});
//   const Vec4 off = -error.A.ldlt().solve(error.a);         // (rad, rad, rad, s), R exp(off) fits best
#pragma once

#include <optional>
#include <vector>

#include "fbvins/geometry/so3.hpp"
#include "fbvins/imu/gyro_turns.hpp"

namespace fbvins {

/// Directions of a track in two images, in the axes of the turn, and their rows from the middle.
struct SeenTwice {
  Vec3 a, b;
  double sigma, rows_a, rows_b;
};

/// From the middle row of one image to that of the other, and how each image's rows turn beside it.
struct PredictedTurnOfPair {
  Mat3 R;
  TurnAround around_a, around_b;
  double line_delay_s;
  double dt_s;
};

/// The cost of an error e = (turn, line delay) is cost + 2 a e + e A e, the parallax that the tracks have in common eliminated.
struct TurnError {
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  Eigen::Vector4d a = Eigen::Vector4d::Zero();
  double cost = 0;
  double rows = 0;  ///< of the residual, less what is eliminated; what parallax hides counts for nothing
  Vec3 parallax = Vec3::Zero();
};

/// `near`: the parallax that was found under a turn that differs little.
TurnError turn_error(const std::vector<SeenTwice>& tracks, const PredictedTurnOfPair& turn, const std::optional<Vec3>& near);

}  // namespace fbvins
