// SPDX-License-Identifier: Apache-2.0
// Who is in the sliding window: keyframes, the newest frames beside them, and the landmarks they see
// (paper 2.1.2). Keeps the books. Numbers go out as a WindowProblem and come back as one, by the ids of frames and
// landmarks, so that nothing depends on when; they are the solver's (window_solver.hpp).
//
// frames: [ keyframes ... | newest_frames ... ], oldest first. One owner, one thread.
//
//   window.add_frame(frame, features, calibration);
//   window.describe(calibration, solution.window);
//   solver.solve(solution, options);
//   window.accept(solution.window);
#pragma once

#include <span>
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
  /// Level is turned about this point from now on.
  void set_pivot(const Vec3& p_W) { tilt_.pivot_W = p_W; }
  const WindowPrior& prior() const { return prior_; }
  void set_prior(WindowPrior prior);
  /// Moves the linearisation point of the prior to the present states; its mean and covariance stay. Only
  /// while it is linear by nature: the prior of the first frame, not yet one made of measurements.
  void restart_first_estimates();

  /// Appends a frame and files the sightings of its features; triangulates what can be.
  void add_frame(Frame frame, const std::vector<TrackedFeature>& features, const Calibration& calibration);
  void make_newest_keyframe(bool keyframe) { frames_.newest().keyframe = keyframe; }
  /// Of one frame; they move out.
  StereoFrame take_images(int frame) { return std::exchange(frames_[frame].images, {}); }

  /// Fills `out` with the window: the landmarks seen by most frames, if there are too many.
  void describe(const Calibration& calibration, WindowProblem& out) const;
  /// Takes a solution back: the frames and landmarks it names that are still here.
  void accept(const WindowProblem& solved);
  /// Landmarks far from their prior are others, or have been moved: they count as new ones. Returns how many.
  int refuse_landmark_priors(const WindowProblem& solved);
  /// Removes observations far off in a solution, and landmarks that are left with too little. Returns how many observations.
  int remove_outliers(const WindowProblem& solved);

  /// A frame that is not a keyframe leaves: its IMU readings join those of the next frame.
  void drop_frame(int index, const Calibration& calibration);
  /// A keyframe leaves through marginalisation, with the landmarks it hosts; they are known from now on.
  void marginalise_keyframe(int index, const Calibration& calibration);

  /// Landmarks that have left the window.
  KnownLandmarks& known() { return known_; }
  const KnownLandmarks& known() const { return known_; }

 private:
  /// Positions are remembered in a W that is not turned: where W is turned level (UpDirection::fixed), positions in it change.
  bool remembers_landmarks() const { return options_.known_landmarks.enabled && weights_.estimate_tilt; }
  void refuse_distant_prior(Landmark& landmark, const Calibration& calibration);
  void drop_prior(Landmark& landmark);
  void strike(Landmark& landmark, const WindowProblem& solved, const WindowLandmark& numbers);
  void forget_sightings(FrameId frame, const Calibration& calibration);
  void forget_frame(int index);
  void remember(const WindowProblem& problem, std::span<const LeavingLandmark> leaving, std::span<const Mat3> information);
  void take_leave(const WindowProblem& problem, const LeavingLandmark& leaving, int newest_begin, const Calibration& calibration);

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
  Leaving leaving_;
};

}  // namespace fbvins
