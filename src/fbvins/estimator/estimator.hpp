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
#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/estimator/initialiser.hpp"
#include "fbvins/estimator/keyframe_policy.hpp"
#include "fbvins/estimator/rest_detector.hpp"
#include "fbvins/estimator/sliding_window.hpp"
#include "fbvins/types/odometry.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// What one frame brought: its pose, the keyframes that have become final with it, and the landmarks that left the window.
struct Estimate {
  Odometry odometry;
  std::vector<Keyframe> keyframes;
  LandmarkUpdate landmarks;  ///< for the frontend
};

class Estimator {
 public:
  Estimator(const StereoRig& rig, const EstimatorOptions& options);

  /// The state at the frame's stamp. Never a silent wrong pose: health says what it is worth.
  Estimate process(const TrackedFrame& frame);

  /// For the frontend: the newest state in the window's W, not levelled; not valid before initialisation.
  StatePrior prior() const;
  WindowSnapshot snapshot() const { return window_.snapshot(calibration_); }
  const Calibration& calibration() const { return calibration_; }
  /// For tests and those who want to look inside.
  const SlidingWindow& window() const { return window_; }

 private:
  Odometry initialise(const TrackedFrame& frame, Duration rest);
  Odometry track(const TrackedFrame& frame, Duration rest);
  Frame predict(const TrackedFrame& frame) const;
  void solve(Odometry& out, const LmOptions& lm);
  void fill_covariances(Odometry& out);
  void choose_keyframe(bool standstill, Odometry& out);
  void shrink_window(Odometry& out);
  void hand_on_keyframes(int keyframe_zone);
  Health judge(const TrackedFrame& frame);
  void restart();
  void fill(Odometry& out);
  WindowWeights weights() const;
  Vec3 gravity_W() const;

  EstimatorOptions options_;
  StereoRig rig_;
  ImuNoise imu_noise_;  ///< calibrated noise times the options' factors
  Calibration calibration_;
  Initialiser initialiser_;
  RestDetector rest_;
  KeyframePolicy keyframe_policy_;
  SlidingWindow window_;
  WindowProblem problem_;
  bool running_ = false;
  bool estimates_tilt_ = true;  ///< a W in which landmarks are remembered is not turned
  std::uint32_t reset_counter_ = 0;
  int failed_solves_ = 0;
  std::optional<Time> previous_frame_, last_good_tracking_;
  Vec3 last_rate_ = Vec3::Zero();
  FrameId newest_handed_on_;
  std::int64_t next_update_ = 0;            ///< sequence number
  std::vector<Keyframe> keyframes_;         ///< that became final with the present frame
  std::optional<Pose<W, B>> restart_pose_;  ///< where the next initial solution puts its first frame (position and yaw)
};

}  // namespace fbvins
