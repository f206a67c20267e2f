// SPDX-License-Identifier: Apache-2.0
// Private to mocap: where the markers sit and how the clocks differ, by maximum likelihood over all pairs of poses with
// noise that is correlated in time (docs/derivations/hand_eye.md).
//
//   HandEyeSolver solver(curve, estimate, start, options);
//   solver.run();
//   HandEye found = solver.result();
#pragma once

#include <array>
#include <vector>

#include "fbvins/mocap/hand_eye.hpp"
#include "fbvins/mocap/hand_eye_pairs.hpp"
#include "fbvins/mocap/serial_noise.hpp"

namespace fbvins {

/// Indices of the unknowns, as in HandEye::covariance.
namespace hand_eye {
inline constexpr int kLever = 0, kTurnBK = 3, kShiftVW = 6, kTurnVW = 9, kOffset = 12, kDrift = 13, kScale = 14, kBend = 15;
}

class HandEyeSolver {
 public:
  HandEyeSolver(const MarkerCurve& curve, Trajectory<W> estimate, MarkerCalibration start, const HandEyeOptions& options);
  void run();
  HandEye result() const;

 private:
  using Rows = std::array<SerialRows, 6>;

  Rows rows() const;
  std::vector<Vec3> bends_of(const std::vector<HandEyePair>& pairs) const;
  NormalSums sum_all(const Rows& rows) const;
  NormalSums with_loose(NormalSums sums) const;
  double disagreement(const Rows& all) const;
  void step_until_still();
  void fit_noise();
  void drop_outliers();

  const MarkerCurve& curve_;
  Trajectory<W> estimate_;
  MarkerCalibration c_;
  std::vector<int> unknowns_;
  std::array<SerialNoise, 4> noise_;
  double scale_ = 0, bend_ = 0;  ///< of the estimate's own errors
  int pairs_ = 0, outliers_ = 0;
};

}  // namespace fbvins
