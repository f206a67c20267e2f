// SPDX-License-Identifier: Apache-2.0
#include "fbvins/boards/board_motion.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace {

/// Sines of frequencies that have no common period, between -1 and 1.
class Wandering {
 public:
  explicit Wandering(Rng& rng) {
    for (std::size_t i = 0; i < kParts; ++i) {
      hz_[i] = rng.uniform(0.08, 0.2) * std::pow(2.2, static_cast<double>(i));
      phase_[i] = rng.uniform(0, 2 * std::numbers::pi);
    }
  }
  double at(double t_s) const {
    constexpr double kShare[kParts] = {0.55, 0.35, 0.1};
    double sum = 0;
    for (std::size_t i = 0; i < kParts; ++i) sum += kShare[i] * std::sin(2 * std::numbers::pi * hz_[i] * t_s + phase_[i]);
    return sum;
  }

 private:
  static constexpr std::size_t kParts = 3;
  std::array<double, kParts> hz_{}, phase_{};
};

}  // namespace

Pose<W, T> hanging_board(const Board& board) {
  Mat3 R_WT;
  R_WT << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return {R_WT, Vec3(Vec3(0, 0, 1.4) - R_WT * (0.5 * board.corner(board.corner_count() - 1)))};
}

SplineTrajectory hand_before_board(const Board& board, double focal_ratio, const Pose<B, C0>& T_BC0, double duration_s,
                                   std::uint64_t seed, const HandMotion& motion) {
  Rng rng(seed);
  std::vector<Wandering> wander;
  for (int i = 0; i < 6; ++i) wander.emplace_back(rng);
  const auto made = [&](bool movement, std::size_t which, double t) { return movement ? wander[which].at(t) : 0.0; };
  constexpr double kKnot_s = 0.1;
  const double extent_m = board.corner(board.corner_count() - 1).norm();
  const Vec3 centre_T = 0.5 * board.corner(board.corner_count() - 1);
  const Pose<W, T> T_WT = hanging_board(board);
  std::vector<Vec3> positions;
  std::vector<Quat> rotations;
  for (int knot = 0; knot < static_cast<int>(duration_s / kKnot_s) + 7; ++knot) {
    const double t = knot * kKnot_s;
    const double distance_m = extent_m * focal_ratio * (1.7 + 0.7 * made(motion.distance, 0, t));
    // The camera's direction from the board, up to 45 degrees to each side, and the point at which it looks.
    const double across = 0.8 * made(motion.across, 1, t), up = 0.8 * made(motion.up, 2, t);
    const Vec3 from = distance_m * Vec3(std::sin(across), std::sin(up) * std::cos(across), std::cos(up) * std::cos(across));
    const Vec3 aim_T =
        centre_T + 0.45 * distance_m / focal_ratio * 0.55 * Vec3(made(motion.aim, 3, t), 0.7 * made(motion.aim, 4, t), 0);
    const Vec3 p_TC = centre_T + from, z = (aim_T - p_TC).normalized(), x = Vec3(0, -1, 0).cross(z).normalized();
    Mat3 R_TC;
    R_TC << x, z.cross(x), z;
    const Pose<T, C0> T_TC0(Quat(R_TC) * so3_exp(Vec3(0, 0, 0.9 * made(motion.roll, 5, t))), p_TC);
    const Pose<W, B> T_WB = T_WT * T_TC0 * T_BC0.inverse();
    positions.push_back(T_WB.p);
    rotations.push_back(T_WB.q);
  }
  return {kKnot_s, std::move(positions), std::move(rotations)};
}

}  // namespace fbvins
