// SPDX-License-Identifier: Apache-2.0
// The first states of a flight (paper 2.2.4), from rest or in motion, whichever the data allow:
//   rest     gravity and gyroscope bias from the IMU; the pose does not move;
//   motion   stereo structure from motion over the last frames, then visual-inertial alignment; with one camera, tracks and
//            readings together (mono_start.hpp): at rest one camera shows no depth.
// An initial solution that is not observable or not plausible is refused, and tried again with the
// next frame. One owner, one thread.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/estimator/sliding_window.hpp"
#include "fbvins/estimator/window_solver.hpp"
#include "fbvins/imu/standing_bias.hpp"
#include "fbvins/imu/static_initialiser.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

/// States of consecutive frames, the last being the newest.
struct InitialSolution {
  std::vector<TrackedFrame> frames;
  std::vector<NavState<G>> states;
  bool from_rest = false;
  ImuBiasEstimate biases;  ///< their prior, before these frames
};

/// The newest frames that are at least so far apart, with the readings between them.
class SpacedFrames {
 public:
  void add(TrackedFrame frame, double spacing_s);
  bool full() const;
  void clear() { frames_.clear(); }
  const std::deque<TrackedFrame>& all() const { return frames_; }

 private:
  std::deque<TrackedFrame> frames_;
};

class Initialiser {
 public:
  /// `before`: the IMU's biases at the end of an earlier flight. `one_camera`: the rig has one only.
  Initialiser(const EstimatorOptions& options, const ImuNoise& noise, const std::optional<ImuState>& before = {},
              bool one_camera = false);

  void reset() {
    frames_.clear();
    near_.clear();
    readings_.clear();
    skipped_ = {};
  }
  /// Takes the next frame; a solution when there is one, else reason() says what is missing.
  /// `rest`: how long the body has stood still. G is placed so that the first frame has the
  /// position and heading of `origin`, if there is one; the vehicle may be in the air then.
  std::optional<InitialSolution> process(const TrackedFrame& frame, Duration rest, const Calibration& calibration,
                                         const std::optional<Pose<G, B>>& origin);
  HealthReason reason() const { return reason_; }

 private:
  bool by_one_camera(const TrackedFrame& frame) const;
  void remember(const TrackedFrame& frame, bool at_rest);
  int usable_features(const TrackedFrame& frame, bool at_rest) const;
  std::vector<ImuSample> newest_readings() const;
  RestOptions rest_options() const;
  ImuBiasEstimate as_it_stands(const ImuBiasEstimate& prior, bool at_rest);
  std::optional<InitialSolution> start_from_rest(const ImuBiasEstimate& biases);
  std::optional<InitialSolution> start_with_one_camera(const SpacedFrames& frames, const ImuBiasEstimate& biases,
                                                       const Calibration& calibration);
  std::optional<InitialSolution> start_in_motion(const ImuBiasEstimate& biases, const Calibration& calibration);
  bool refine_structure(const Calibration& calibration);
  bool stereo_structure(const Calibration& calibration, std::vector<Pose<G, B>>& poses);

  double gravity_mps2_;
  ImuNoise noise_;
  std::optional<ImuState> before_;
  std::optional<LevelStand> stand_;       ///< before the first start
  std::optional<ImuBiasEstimate> stood_;  ///< as the floor has told them
  bool one_camera_;
  SpacedFrames frames_, near_;       ///< the second with one camera: of a motion that shows the scale sooner
  std::deque<ImuSegment> readings_;  ///< of the last moments, to decide whether the body is at rest
  SlidingWindow structure_;
  WindowSolver solver_;
  ImuSegment skipped_;  ///< readings of images since the last frame, in which a camera was missing
  HealthReason reason_ = HealthReason::waiting_for_motion_or_rest;
};

}  // namespace fbvins
