// SPDX-License-Identifier: Apache-2.0
// Block Schur elimination of many small three-dimensional variables ("points"), each coupled to a
// few six-dimensional blocks of a dense system. Knows nothing of cameras.
//
// For each point, with V its own 3x3 block, w its gradient and W_k its coupling with block k:
//   H_kl -= W_k V^-1 W_l^T,   g_k -= W_k V^-1 w,   back-substitution: dx = -V^-1 (w + sum W_k^T dx_k)
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace fbvins {

/// Normal equations of one point; its coupling is PointBlocks::coupling(), blocks in ascending order of offset.
struct PointBlock {
  Eigen::Matrix3d V;
  Eigen::Vector3d w;
  Eigen::Matrix3d V_inverse;  ///< damped, set by eliminate()
  int first = 0;              ///< index of the first block in PointBlocks::offsets
  int count = 0;              ///< number of blocks
};

/// What is added to the third diagonal element of a point's block.
struct ThirdDamping {
  double most = 0;
  bool fades = false;  ///< where the block has much more information of its own

  double of(const PointBlock& point) const { return fades && most > 0 ? most * most / (most + point.V(2, 2)) : most; }
};

/// Storage for all points of a problem; cleared and refilled without giving memory back.
class PointBlocks {
 public:
  void clear() {
    points_.clear();
    offsets_.clear();
    coupling_.clear();
  }
  /// Opens a point coupled to the blocks at `offsets` (row of the dense system, ascending); all zero.
  PointBlock& add(std::span<const int> offsets);
  std::vector<PointBlock>& points() { return points_; }
  const std::vector<PointBlock>& points() const { return points_; }
  /// W_k^T of a point: 3 x 6, column-major.
  Eigen::Map<Eigen::Matrix<double, 3, 6>> coupling(const PointBlock& point, int k) {
    return Eigen::Map<Eigen::Matrix<double, 3, 6>>(coupling_.data() + 18 * (point.first + k));
  }

  /// Subtracts every point from the lower triangle of H (column-major) and from g.
  /// V is damped by lambda times its diagonal, its third element by `third` as well. False if some V is not
  /// positive definite.
  bool eliminate(double lambda, Eigen::MatrixXd& H, Eigen::VectorXd& g, const ThirdDamping& third = {});
  /// Subtracts W_k V^-1 w of every point from g, with the V^-1 of eliminate().
  void eliminate_gradient(Eigen::VectorXd& g) const;
  /// The step of each point for a step of the dense system: dx = -V^-1 (w + sum W_k^T dx_k), with the V^-1 that
  /// eliminate() damped.
  void back_substitute(const Eigen::VectorXd& step, std::vector<Eigen::Vector3d>& point_steps) const;

 private:
  std::vector<PointBlock> points_;
  std::vector<int> offsets_;
  std::vector<double> coupling_;
  std::vector<double> scratch_;
};

}  // namespace fbvins
