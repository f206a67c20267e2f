// SPDX-License-Identifier: Apache-2.0
// Private: lenses, extrinsics and board poses adjusted together. The poses are eliminated one by one (Schur), so that the
// system to solve has the cameras' parameters only, and its inverse is their covariance. One thread.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/camera_calibration.hpp"

namespace fbvins {

struct SeenCorner {
  int index = 0;
  Vec3 p_T;
  Vec2 pixel;
  bool kept = true;
};

struct SeenBoard {
  int camera = 0;
  std::vector<SeenCorner> corners;
};

/// What all cameras see at one stamp.
struct RigFrame {
  Time t;
  std::vector<SeenBoard> views;
  Pose<C0, T> T_C0T;
};

struct RigCamera {
  LensModel lens;
  Pose<Cn, C0> T_CnC0;
};

struct AdjustmentOptions {
  double spread_px = 0;     ///< residuals beyond it count linearly (Huber); 0: plain least squares
  bool poses_only = false;  ///< lenses and extrinsics stay
  int max_iterations = 60;
};

struct AdjustmentSummary {
  double cost = 0;  ///< half the sum of squares, of the loss where there is one
  int iterations = 0;
  bool usable = true;
};

class RigAdjustment {
 public:
  RigAdjustment(std::vector<RigCamera> cameras, std::vector<RigFrame> frames);

  AdjustmentSummary solve(const AdjustmentOptions& options);

  const std::vector<RigCamera>& cameras() const { return cameras_; }
  const std::vector<RigFrame>& frames() const { return frames_; }
  std::vector<RigFrame>& frames() { return frames_; }

  /// Parameters: of each camera its lens, then (but for cam0) position and rotation of T_CnC0.
  int parameter_count() const { return size_; }
  int first_of(int camera) const { return first_[camera]; }
  /// What one frame says about them, its pose unknown, for a noise of 1 px: its part of the normal equations.
  struct Evidence {
    Eigen::MatrixXd information;
    Eigen::VectorXd gradient;  ///< of the sum over all frames it is 0 where the adjustment has converged
  };
  Evidence evidence(const RigFrame& frame) const;
  /// Of each frame.
  std::vector<Evidence> evidence() const;

  /// Detected minus predicted; not finite where the lens has no such ray.
  Vec2 residual(const RigFrame& frame, const SeenBoard& view, const SeenCorner& corner) const;

 private:
  struct FrameEquations;
  using PoseFactor = Eigen::LDLT<Mat6>;
  FrameEquations linearise(const RigFrame& frame, double spread_px) const;
  double cost(const RigFrame& frame, double spread_px) const;
  double total_cost(double spread_px) const;
  Eigen::VectorXd camera_step(const std::vector<FrameEquations>& equations, double lambda, bool poses_only,
                              std::vector<PoseFactor>& factors) const;
  void move_poses(const std::vector<FrameEquations>& equations, const std::vector<PoseFactor>& factors,
                  const Eigen::VectorXd& step);

  std::vector<RigCamera> cameras_;
  std::vector<RigFrame> frames_;
  std::vector<int> first_;  ///< first parameter of each camera
  int size_ = 0;
};

}  // namespace fbvins
