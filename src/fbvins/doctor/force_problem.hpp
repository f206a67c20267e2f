// SPDX-License-Identifier: Apache-2.0
// Private to the doctor: tracks of one camera, without depths, as the motion by the IMU alone predicts them over windows of
// one and a half seconds; a least-squares problem in what the accelerometer is wrong by. True specific force: M reading + c, with
// M = diag(exp(common + axis)) + cross. Of each window the points, velocity, gravity, whose magnitude is known, and a small bias
// of the gyroscope are eliminated. The method: docs/doctor.md.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/doctor/block_fit.hpp"
#include "fbvins/doctor/evidence.hpp"
#include "fbvins/doctor/imu_series.hpp"

namespace fbvins {

namespace doctor::force {
enum : int { kScale = 0, kAxis = 1, kCross = 4, kBias = 10, kUnknowns = 13 };
/// Row and column of a cross term.
inline constexpr int kRow[6] = {0, 0, 1, 1, 2, 2}, kColumn[6] = {1, 2, 0, 2, 0, 1};

using VecX = Eigen::Matrix<double, kUnknowns, 1>;
using Mat39 = Eigen::Matrix<double, 3, 9>;

/// A feature in an image, and the motion of the body from the window's beginning to when its line was taken.
struct Sight {
  Vec3 ray_B = Vec3::Zero();  ///< of length 1
  double t_s = 0;
  Mat3 R = Mat3::Identity();       ///< body to window
  Mat39 p_matrix = Mat39::Zero();  ///< position, by each entry of M, row by row
  Mat3 p_bias = Mat3::Zero();      ///< by c
  Mat3 p_gyro = Mat3::Zero();      ///< by a bias of the gyroscope
  Mat3 turn_gyro = Mat3::Zero();   ///< rotation vector in the window, likewise
};

struct Track {
  std::vector<Sight> sights;
  Vec3 point = Vec3::Zero();  ///< in the window, m; the window's origin is the body at its beginning
};

struct Window {
  std::vector<Track> tracks;
  Eigen::Matrix<double, 9, 1> motion = Eigen::Matrix<double, 9, 1>::Zero();  ///< velocity, gravity, gyroscope's bias
  bool settled = false, usable = true;
};

/// By what the mounting, the lens, the times and the gyroscope of `rig` and `imu` say.
std::vector<Window> windows_of(const Evidence& evidence, const ImuSeries& imu, const StereoRig& rig, double offset_s,
                               const Vec3& gyro_bias);
}  // namespace doctor::force

/// A Fit of change_search.hpp.
class ForceProblem {
 public:
  static constexpr double kAsGood = 0.98;

  ForceProblem(std::vector<doctor::force::Window> windows, const Vec3& p_BC, double focal_px);

  /// Finds points and motion of the windows, and leaves out those where it does not. To be called once, first.
  void begin();
  std::size_t windows() const;
  std::optional<BlockSolution> converge();
  bool plausible() const;
  double typical_error() const;
  double capped_error() const;
  /// M of the present estimate.
  Mat3 matrix() const;

  Eigen::VectorXd x;
  std::vector<int> free;

 private:
  struct Reduced;
  std::optional<BlockSolution> solve(double sigma) const;
  void follow(const Eigen::VectorXd& step, double sigma);
  void settle_all(int times);
  double error_of(const doctor::force::Window& window) const;
  bool settle(doctor::force::Window& window, double sigma) const;
  Reduced linearise(const doctor::force::Window& window, double sigma, bool first) const;

  std::vector<doctor::force::Window> windows_;
  Vec3 p_BC_;
  double focal_px_;
};

}  // namespace fbvins
