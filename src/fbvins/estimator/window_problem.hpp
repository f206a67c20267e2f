// SPDX-License-Identifier: Apache-2.0
// The sliding window as a least-squares problem: frame states, the tilt of G, landmarks and, if wanted,
// calibration, with all their measurements. A value: it names its frames and landmarks by the window's ids, and
// stays valid when the window changes. Minimised by window_solver.hpp. Formulas: docs/derivations/window.md (W1-W16).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/estimator/factor.hpp"
#include "fbvins/estimator/landmark_prior.hpp"
#include "fbvins/estimator/reprojection.hpp"
#include "fbvins/estimator/tilt.hpp"
#include "fbvins/imu/nav_state.hpp"
#include "fbvins/optim/quadratic_prior.hpp"

namespace fbvins {

struct WindowFrame {
  FrameId id;
  NavState<G> state;
  /// State when the prior first named this frame: linearisation point and origin of the prior (W9).
  NavState<G> first_estimate;
  bool in_prior = false;
};

/// Terms and weights that are not measurements of a frame.
struct WindowWeights {
  double huber_sigma = 2.0;
  double gravity_mps2 = 9.81;
  double min_inverse_depth_1pm = 0.005;  ///< landmarks are kept nearer than 1 / this
  bool images_show_scale = true;         ///< false: of one camera, which shows everything else
  bool at_first_estimates = false;       ///< Jacobians of frames in the prior are taken at their first estimates
  bool estimate_tilt = true;             ///< false: G is level
  bool estimate_extrinsics = false;
  bool estimate_time_offset = false;
  bool estimate_line_delay = false;

  bool calibrating() const { return estimate_extrinsics || estimate_time_offset || estimate_line_delay; }
};

/// T_BC0 (dp, dtheta), T_BC1 (dp, dtheta), time offset, line delay, and padding to whole blocks of six.
inline constexpr int kCalibrationSize = 18;
inline constexpr int kTimeOffsetIndex = 12, kLineDelayIndex = 13;
inline constexpr int kTiltSize = 2;
using Vec18 = Eigen::Matrix<double, kCalibrationSize, 1>;

/// `calibration` minus `from`, as a perturbation of `from`.
Vec18 calibration_displacement(const Calibration& calibration, const Calibration& from);

/// A variable that factors bring along: it lives as long as one of them names it, or their maker wants it. A vector; what is not
/// one is estimated as the difference from a value that its factors keep.
struct OwnVariable {
  int number = -1;  ///< never used again
  std::string name;
  Eigen::VectorXd value;
  bool is_wanted = false;  ///< also while nothing of the window measures it
};

/// A quadratic over, in this order, the tilt, the calibration (if estimated), the factors' own variables and 15 numbers
/// (p, theta, v, bg, ba) of some frames. The tilt and own variables are measured from zero, frames from their first estimates.
struct WindowPrior {
  QuadraticPrior quadratic;
  std::vector<int> own = {};  ///< numbers, ascending
  int own_size = 0;           ///< of all of them
  std::vector<int> frames;    ///< indices into WindowProblem::frames
  bool with_tilt = false;
  bool with_calibration = false;
  Calibration calibration;  ///< linearisation point of the calibration
  bool empty() const { return quadratic.size() == 0; }
  int calibration_row() const { return with_tilt ? kTiltSize : 0; }
  int own_row() const { return calibration_row() + (with_calibration ? kCalibrationSize : 0); }
  int frames_row() const { return own_row() + own_size; }
};

struct WindowProblem {
  std::vector<WindowFrame> frames;
  std::vector<WindowLandmark> landmarks;
  std::vector<WindowObservation> observations;
  std::vector<LandmarkPrior> landmark_priors;
  /// All but the prior and what landmarks give, whose frames are all in the window: those of a kind are neighbours, by frame.
  std::vector<std::shared_ptr<const Factor>> factors;
  std::vector<OwnVariable> own;  ///< numbers ascend
  Tilt tilt;
  Calibration calibration;
  WindowPrior prior;
  WindowWeights weights;

  bool calibrating() const { return weights.calibrating(); }
  int frame_count() const { return static_cast<int>(frames.size()); }
  /// -1 where there is none.
  int index_of(FrameId id) const;
  /// Of a frame that is in the window.
  const WindowFrame& frame(FrameId id) const { return frames[static_cast<std::size_t>(index_of(id))]; }
  /// Where Jacobians of a frame are taken.
  NavState<G> linearisation_point(int frame) const {
    const WindowFrame& f = frames[static_cast<std::size_t>(frame)];
    return weights.at_first_estimates && f.in_prior ? f.first_estimate : f.state;
  }

  /// Whitened reprojection residuals of a landmark's observations at the current estimate; infinite behind the camera. `cameras`:
  /// of the calibration.
  void residuals(const CameraGeometry& cameras, const WindowLandmark& landmark, std::vector<Vec2>& out) const;
  /// Whitened distance of a landmark that has a prior from it, at the current estimate.
  Vec3 distance_to_prior(const WindowLandmark& landmark) const;
  /// Of one that it has.
  const OwnVariable& own_variable(int number) const;
  /// How far the variables of a prior are from its origin. Zero for frames that were in no prior before: it begins at their
  /// state.
  Eigen::VectorXd displacement(const WindowPrior& from) const;
  /// How many numbers a step of the variable has; 0 where it is not estimated.
  int size_of(const Variable& variable) const;
  /// Moves it by a step.
  void move(const Variable& variable, const Eigen::Ref<const Eigen::VectorXd>& step);
};

}  // namespace fbvins
