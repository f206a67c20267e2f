// SPDX-License-Identifier: Apache-2.0
// The contents of the sliding window: keyframes, the newest frames beside them, and the landmarks they see
// (paper 2.1.2). Their estimates are given to the solver (window_solver.hpp) as a WindowProblem and taken back from one, by
// the ids of frames and landmarks, so that the window may have changed in between.
//
// frames: [ keyframes ... | newest_frames ... ], oldest first. One owner, one thread.
//
//   window.add_frame(frame, features, calibration);
//   window.fill_problem(calibration, solution.window);
//   solver.solve(solution, options);
//   window.take_estimates(solution.window);
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/estimator/frame_list.hpp"
#include "fbvins/estimator/known_landmarks.hpp"
#include "fbvins/estimator/landmark_geometry.hpp"
#include "fbvins/estimator/landmark_table.hpp"
#include "fbvins/estimator/window_marginalisation.hpp"
#include "fbvins/estimator/window_problem.hpp"

namespace fbvins {

class SlidingWindow {
 public:
  SlidingWindow(const EstimatorOptions& options, const WindowWeights& weights);

  void clear();
  const FrameList& frames() const { return frames_; }
  const LandmarkTable& landmarks() const { return landmarks_; }
  const Frame& newest() const { return frames_.newest(); }
  const Tilt& tilt() const { return tilt_; }
  /// The point about which poses are levelled from now on.
  void set_pivot(const Vec3& p_G) { tilt_.pivot = p_G; }
  const WindowPrior& prior() const { return prior_; }
  void set_prior(WindowPrior prior);
  /// Moves the linearisation point of the prior to the present states; its mean and covariance stay. Only
  /// for the prior of the first frame, not for one that holds linearised measurements.
  void restart_first_estimates();

  /// Appends a frame and the observations of its features; triangulates the landmarks that can be.
  void add_frame(Frame frame, const std::vector<TrackedFeature>& features, const Calibration& calibration);
  void make_newest_keyframe(bool keyframe) { frames_.newest().keyframe = keyframe; }
  /// Moves the images of a frame out.
  StereoFrame take_images(int frame) { return std::exchange(frames_[frame].images, {}); }

  /// Fills `out` with the window; if there are too many landmarks, with those seen by most frames.
  void fill_problem(const Calibration& calibration, WindowProblem& out) const;
  /// Takes over the estimates of a solution for the frames and landmarks that are still in the window.
  void take_estimates(const WindowProblem& solved);
  /// Forgets where landmarks were before: the estimate has moved against them by an unknown amount.
  void forget_known();
  /// Drops the priors of landmarks far from theirs: mistaken or moved, they count as new ones. Returns how many.
  int refuse_landmark_priors(const WindowProblem& solved);
  /// Removes outliers among the observations, and landmarks that are left with too few. Returns how many observations.
  int remove_outliers(const WindowProblem& solved);

  /// A frame that is not a keyframe leaves: its IMU readings join those of the next frame, or the prior if that names it.
  void drop_frame(int index, const Calibration& calibration);
  /// A keyframe leaves through marginalisation, with the landmarks it hosts; they are known from now on.
  void marginalise_keyframe(int index, const Calibration& calibration);

  /// A new variable of the factors' own, and its number. It is wanted until told otherwise.
  int add_own(std::string name, const Eigen::VectorXd& value);
  const std::vector<OwnVariable>& own() const { return own_; }
  /// Null where it is gone.
  const OwnVariable* own(int number) const;
  void end_own(int number);

  /// Landmarks that have left the window.
  KnownLandmarks& known() { return known_; }
  const KnownLandmarks& known() const { return known_; }

 private:
  void add_observations(Landmark& landmark, const TrackedFeature& feature) const;
  void refuse_distant_prior(Landmark& landmark, const Calibration& calibration);
  void drop_prior(Landmark& landmark);
  void count_outlier(Landmark& landmark, const WindowProblem& solved, const WindowLandmark& numbers);
  void forget_observations(FrameId frame, const Calibration& calibration);
  void take_over_factors(const Frame& leaving, Frame& next);
  void forget_frame(int index);
  void forget_unused_own();
  void remember(const WindowProblem& problem, std::span<const LeavingLandmark> leaving, std::span<const Mat3> information);
  void keep_newest_observations(const WindowProblem& problem, const LeavingLandmark& leaving, int newest_begin,
                                const Calibration& calibration);

  /// Working memory of marginalise_keyframe() and drop_frame().
  struct Leaving {
    WindowProblem problem;
    MarginalisationMemory memory;
  };

  EstimatorOptions options_;
  WindowWeights weights_;
  FrameList frames_;
  LandmarkTable landmarks_;
  KnownLandmarks known_;
  WindowPrior prior_;
  Tilt tilt_;
  std::vector<OwnVariable> own_;
  int next_own_ = 0;
  Leaving leaving_;
};

}  // namespace fbvins
