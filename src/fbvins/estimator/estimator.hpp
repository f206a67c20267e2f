// SPDX-License-Identifier: Apache-2.0
// TrackedFrame + IMU -> Odometry: initialisation, the sliding window, marginalisation (paper 2.1.2, 2.2.4).
// A plain synchronous stage; one instance is used by one thread at a time.
//
//   Estimator estimator(rig, EstimatorOptions{});
//   Estimate estimate = estimator.process(tracked_frame);
//   if (estimate.odometry.health.has_pose()) use(estimate.odometry.T_WB);
#pragma once

#include <optional>

#include "fbvins/camera/camera.hpp"
#include "fbvins/estimator/consistency_monitor.hpp"
#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/estimator/exposures.hpp"
#include "fbvins/estimator/factor_maker.hpp"
#include "fbvins/estimator/frame_contract.hpp"
#include "fbvins/estimator/health_judge.hpp"
#include "fbvins/estimator/initialiser.hpp"
#include "fbvins/estimator/keyframe_policy.hpp"
#include "fbvins/estimator/propagated_state.hpp"
#include "fbvins/estimator/published_pose.hpp"
#include "fbvins/estimator/rest_detector.hpp"
#include "fbvins/estimator/sliding_window.hpp"
#include "fbvins/estimator/state_uncertainty.hpp"
#include "fbvins/estimator/time_alignment.hpp"
#include "fbvins/estimator/window_solver.hpp"
#include "fbvins/imu/reading_noise.hpp"
#include "fbvins/types/keyframe.hpp"
#include "fbvins/types/odometry.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// Result of one frame: its pose, the keyframes that have become final with it, and the landmarks that left the window.
struct Estimate {
  Odometry odometry;
  std::vector<Keyframe> keyframes;
  LandmarkUpdate landmarks;  ///< for the frontend
  ImuNoiseScale imu_noise;   ///< with which the frame's readings count
};

class Estimator {
 public:
  /// `before`: the IMU's biases at the end of an earlier flight.
  Estimator(const StereoRig& rig, const EstimatorOptions& options, const std::optional<ImuState>& before = {},
            const std::vector<std::shared_ptr<OwnSensor>>& sensors = {});

  /// The state at the frame's stamp; health says whether it may be trusted.
  Estimate process(const TrackedFrame& tracked);
  /// As after `lost`: a new start, in a W placed at the last pose. Before the first start what was gathered for it is forgotten.
  /// After a clock was set back the start has to prove itself: until a clock that goes back again is corrected, readings and
  /// images lie apart.
  void start_again(bool clock_set_back = false) {
    if (running_) {
      restart();
    } else {
      initialiser_.reset();
      rest_.reset();
    }
    if (clock_set_back) carried_.dispute();
  }

  /// For the frontend: the newest state, in G; not valid before initialisation.
  StatePrior prior() const;
  WindowSnapshot snapshot() const;
  const Calibration& calibration() const { return calibration_; }
  /// What the rig's time offset and line delay are corrected by (System applies the first).
  const TimeAlignment& time_alignment() const { return time_alignment_; }
  /// For tests and inspection.
  const SlidingWindow& window() const { return window_; }

 private:
  /// Of a start with one camera: when it was made, and since when it would have been a good pose.
  struct StartTrial {
    Time since, good_since;
  };

  void initialise(const TrackedFrame& frame, Duration rest, Estimate& out);
  void open_window(const InitialSolution& start);
  void track(const TrackedFrame& frame, Duration rest, Estimate& out);
  TrackedFrame refer_to_stamp(const TrackedFrame& frame) const;
  Frame predict(const TrackedFrame& frame, const ImuSegment& imu) const;
  std::vector<TrackedFeature> check_readings(const TrackedFrame& frame, ImuSegment& imu, Frame& predicted);
  const WindowSolution& solve(Odometry& out, const LmOptions& lm);
  void fill_covariances(const WindowSolution& solution, Odometry& out);
  void shrink_window(const WindowSolution& solution, Estimate& out);
  bool contradicted_too_long(Time t);
  Health judge(const TrackedFrame& frame, const Odometry& solved);
  bool start_is_good(const TrackedFrame& frame, const Odometry& solved);
  void compare_carried(const Odometry& solved);
  void refuse_start(Odometry& out);
  void stay_on_trial(const TrackedFrame& frame, Estimate& out);
  void restart();
  void begin_new_W();
  void apply_or_defer_correction(const Pose<W, B>& level, Odometry& out);
  void publish(Odometry& out);
  Vec3 gravity_G() const;

  EstimatorOptions options_;
  ImuNoise imu_noise_;                    ///< calibrated noise times the options' factors
  Calibration calibrated_, calibration_;  ///< as given, and as estimated
  bool one_camera_;                       ///< the rig has one only
  StateUncertainty uncertainty_;          ///< as of the last usable solve
  TimeAlignment time_alignment_;
  Exposures exposures_;
  FactorMakers factors_;
  TrackedFrame referred_;  ///< the newest frame, where not all of it was seen at its stamp
  Initialiser initialiser_;
  RestDetector rest_;
  KeyframePolicy keyframe_policy_;
  HealthJudge health_;
  FrameContract contract_;
  ReadingNoise reading_noise_;
  ConsistencyMonitor monitor_;
  PropagatedState carried_;
  std::uint8_t wrong_cameras_ = 0;    ///< in the newest frame; bits, as in Health
  int frames_with_readings_ = 0;      ///< in a row
  Time judged_;                       ///< the newest frame that was
  double contradicted_s_ = 0;         ///< one camera: by images that contradict the readings, less those that do not
  std::optional<Time> bias_refused_;  ///< since when starts of this try have a bias that tracks do not show
  std::optional<Time> last_trouble_;  ///< of a pose that was not good
  SlidingWindow window_;
  WindowSolver solver_;
  WindowSolution solution_;  ///< of the newest solve; a member so that its memory is reused
  bool running_ = false;
  std::optional<Time> waiting_since_;  ///< for the first pose, or the first one after a loss
  std::optional<StartTrial> trial_;    ///< one camera: the window goes on, and nothing of it is published yet
  std::uint32_t reset_counter_ = 0;
  int failed_solves_ = 0;
  Vec3 last_rate_ = Vec3::Zero();
  PublishedPose published_;
  std::int64_t next_update_ = 0;            ///< sequence number
  std::optional<Pose<G, B>> restart_pose_;  ///< where the next G begins: at its first frame (position and heading)
};

}  // namespace fbvins
