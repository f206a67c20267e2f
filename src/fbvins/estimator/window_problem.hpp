// SPDX-License-Identifier: Apache-2.0
// The sliding window as a least-squares problem: reprojection, IMU and prior factors over frame
// states, the tilt of the world, landmarks and, if wanted, calibration. Numbers only; who enters and leaves is decided in
// sliding_window.hpp. Solved by optim/levenberg_marquardt.hpp. Formulas: docs/derivations/window.md (W1-W16).
//
//   WindowProblem problem;
//   problem.frames = ...; problem.landmarks = ...; problem.observations = ...;
//   LmSummary summary = problem.optimise(LmOptions{});
//
// Order of the dense system: 9 of each frame (v, bg, ba), 2 of the tilt and calibration if they are estimated, 6
// of each frame (p, theta): poses that follow one another are neighbours, which the Schur kernel likes.
// One problem is used by one thread; it keeps its working memory from call to call.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/estimator/landmark_belief.hpp"
#include "fbvins/estimator/reprojection.hpp"
#include "fbvins/estimator/tilt.hpp"
#include "fbvins/imu/imu_residual.hpp"
#include "fbvins/imu/preintegration.hpp"
#include "fbvins/optim/levenberg_marquardt.hpp"
#include "fbvins/optim/quadratic_prior.hpp"
#include "fbvins/optim/schur.hpp"

namespace fbvins {

struct WindowFrame {
  NavState state;
  /// State when the prior first named this frame: the prior is built and measured from here (W9).
  NavState first_estimate;
  bool in_prior = false;
  /// From the frame before this one; null where the chain is broken or the prior holds it.
  const Preintegration* imu = nullptr;
  bool standstill = false;
};

/// Terms and weights that are not measurements of a frame.
struct WindowWeights {
  double huber_sigma = 2.0;
  double gravity_mps2 = 9.81;
  double standstill_velocity_sigma_mps = 0.01;
  double min_inverse_depth_1pm = 0.005;  ///< landmarks are kept nearer than 1 / this
  bool at_first_estimates = false;       ///< Jacobians of frames in the prior are taken at their first estimates
  bool estimate_tilt = true;             ///< or W is level
  bool estimate_extrinsics = false;
  bool estimate_time_offset = false;
};

/// T_BC0 (dp, dtheta), T_BC1 (dp, dtheta), time offset, and padding to whole blocks of six.
inline constexpr int kCalibrationSize = 18;
inline constexpr int kTimeOffsetIndex = 12;
inline constexpr int kTiltSize = 2;

/// A quadratic over, in this order, the tilt, the calibration (if estimated) and 15 numbers (p, theta, v, bg, ba)
/// of some frames. The tilt is measured from zero, frames from their first estimates.
struct WindowPrior {
  QuadraticPrior quadratic;
  std::vector<int> frames;  ///< indices into WindowProblem::frames
  bool with_tilt = false;
  bool with_calibration = false;
  Calibration calibration;  ///< linearisation point of the calibration
  bool empty() const { return quadratic.size() == 0; }
  int calibration_row() const { return with_tilt ? kTiltSize : 0; }
  int frames_row() const { return calibration_row() + (with_calibration ? kCalibrationSize : 0); }
};

class WindowProblem {
 public:
  std::vector<WindowFrame> frames;
  std::vector<WindowLandmark> landmarks;
  std::vector<WindowObservation> observations;
  std::vector<LandmarkBelief> beliefs;
  Tilt tilt;
  Calibration calibration;
  WindowPrior prior;
  WindowWeights weights;

  /// Minimises over frames, tilt, landmarks and (if wanted) calibration, in place.
  LmSummary optimise(const LmOptions& options);

  /// Whitened reprojection residual of an observation at the current estimate; infinite behind the camera.
  Vec2 residual(const WindowLandmark& landmark, const WindowObservation& observation) const;

  /// Whitened distance of a landmark that has a belief from it, at the current estimate.
  Vec3 distance_to_belief(const WindowLandmark& landmark) const;

  /// Cost at the current estimate.
  double cost() const;

  // The interface minimise() wants.
  double linearise();
  bool solve(double lambda);
  double predicted_decrease() const { return predicted_decrease_; }
  double step_size() const { return step_size_; }
  double apply_step();
  void undo_step();

  /// The dense system after linearise(), before elimination: lower triangle of H, and g.
  const Eigen::MatrixXd& hessian() const { return H_; }
  const Eigen::VectorXd& gradient() const { return g_; }
  PointBlocks& points() { return points_; }
  /// Information of frames, tilt and calibration with the landmarks eliminated, at the last linearisation;
  /// reduced_gradient() belongs to it.
  Eigen::MatrixXd reduced_information();
  const Eigen::VectorXd& reduced_gradient() const { return reduced_g_; }
  /// Current calibration minus `from`, as a perturbation of `from`.
  Eigen::Matrix<double, kCalibrationSize, 1> calibration_displacement(const Calibration& from) const;
  /// Covariance of a frame's (p, theta, v, bg, ba) and the tilt (zero where it is not estimated) after optimise() or
  /// solve(); false if there is none.
  bool covariance(int frame, Mat17& out);

  bool calibrating() const { return weights.estimate_extrinsics || weights.estimate_time_offset; }
  int tilt_size() const { return weights.estimate_tilt ? kTiltSize : 0; }
  int calibration_size() const { return calibrating() ? kCalibrationSize : 0; }
  int system_size() const { return 15 * static_cast<int>(frames.size()) + tilt_size() + calibration_size(); }
  int speed_bias_row(int frame) const { return 9 * frame; }
  int tilt_row() const { return 9 * static_cast<int>(frames.size()); }
  int calibration_row() const { return tilt_row() + tilt_size(); }
  int pose_row(int frame) const { return calibration_row() + calibration_size() + 6 * frame; }
  /// Row in the dense system of element k of a frame's 15 numbers (p, theta, v, bg, ba).
  int row_of(int frame, int k) const { return k < 6 ? pose_row(frame) + k : speed_bias_row(frame) + k - 6; }
  const std::vector<Vec3>& landmark_steps() const { return point_steps_; }
  const Eigen::VectorXd& step() const { return step_; }

 private:
  void prepare_pairs(bool with_first_estimates);
  double add_prior(bool build);
  double add_imu_terms(bool build);
  double add_standstill_terms(bool build);
  template <int Columns>
  double add_landmarks();
  double landmark_cost() const;
  double add_belief(const CameraGeometry& cameras, const WindowLandmark& landmark, int host_block, PointBlock& point);
  double belief_cost(const CameraGeometry& cameras, const WindowLandmark& landmark) const;
  Eigen::VectorXd prior_displacement() const;
  void fix_inactive_calibration();
  const PairGeometry& pair(int host, int target) const { return pairs_[host * frames.size() + target]; }
  NavState linearisation_point(int i) const {
    return weights.at_first_estimates && frames[i].in_prior ? frames[i].first_estimate : frames[i].state;
  }

  std::vector<PairGeometry> pairs_;
  std::vector<int> prior_rows_;
  Eigen::MatrixXd H_, reduced_;
  Eigen::VectorXd g_, reduced_g_, step_;
  PointBlocks points_;
  std::vector<Vec3> point_steps_;
  std::vector<NavState> saved_states_;
  std::vector<Vec3> saved_landmarks_;
  Calibration saved_calibration_;
  Tilt saved_tilt_;
  Eigen::LLT<Eigen::MatrixXd> llt_{Eigen::MatrixXd::Identity(1, 1)};  // one made of nothing has no state to copy
  double factor_lambda_ = 0;                                          ///< damping in llt_
  double predicted_decrease_ = 0;
  double step_size_ = 0;
};

}  // namespace fbvins
