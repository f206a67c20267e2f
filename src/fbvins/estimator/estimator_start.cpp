// SPDX-License-Identifier: Apache-2.0
// How the estimator starts: the first window, and whether it is good enough to be published.
#include <cmath>

#include "fbvins/core/stage_timer.hpp"
#include "fbvins/estimator/estimator.hpp"
#include "fbvins/estimator/estimator_setup.hpp"
#include "fbvins/estimator/initial_prior.hpp"
#include "fbvins/estimator/integrity_thresholds.hpp"
#include "fbvins/estimator/mono_start.hpp"
#include "fbvins/estimator/window_views.hpp"

namespace fbvins {
namespace {

using namespace thresholds;

/// Of a start with one camera.
constexpr double kMaxScaleSigmaAtStart = 0.15;
/// Likewise: 5 % of right ones are refused, and tried again with the next image (chi-square, three numbers).
constexpr double kMaxBiasSigmasAtStart = 2.8;
/// For so long: axes and scale of a gyroscope that nobody has calibrated look like a bias that changes.
constexpr double kBiasRefused_s = 1;
/// For the first window, which is so short that tilt, velocity and biases hardly change its cost: no stop on a small decrease.
constexpr LmOptions kThorough{.max_iterations = 30, .min_decrease = 1e-9};
/// A start with one camera is published when it would have been good for so long, for less once a pose has been waited for long,
/// and its velocity is so certain, of three axes together: two seconds of it are the largest correction that a good pose may owe.
/// In any case after kLongestTrial_s. Source: docs/experiments/sensors.md#starts-of-one-camera.
constexpr double kGoodOnTrial_s = 1.2, kGoodAtLeast_s = 0.3, kWaitedLong_s = 5, kVelocityOnTrial_mps = 0.05, kLongestTrial_s = 4;

void keep_only_stats(Odometry& out) {
  const EstimatorStats stats = out.stats;
  out = {};
  out.stats = stats;
}

}  // namespace

void Estimator::initialise(const TrackedFrame& frame, Duration rest, Estimate& out) {
  CpuTimer timer;
  if (!waiting_since_) waiting_since_ = frame.t;
  TrackedFrame weighted = frame;
  weighted.imu.noise = reading_noise_.of(frame.imu);
  const std::optional<InitialSolution> start = initialiser_.process(weighted, rest, calibration_, restart_pose_);
  out.odometry.stats.prepare_ms = timer.lap_ms();
  if (!start || (!start->from_rest && !time_alignment_.known())) {
    out.odometry.health = health_.before_start(frame, initialiser_.reason());
    return;
  }
  open_window(*start);
  running_ = true;
  health_.start();
  solve(out.odometry, kThorough);
  // The first solve may have moved the first frame far: the prior is linearised anew at its state.
  window_.restart_first_estimates();
  window_.set_pivot(window_.newest().state.T_FB.p);
  const WindowSolution& solution = solve(out.odometry, kThorough);
  out.odometry.health = judge(frame, out.odometry);
  if (start_is_good(frame, out.odometry)) {
    if (one_camera_) trial_ = {frame.t, frame.t};
    shrink_window(solution, out);
    compare_carried(out.odometry);
    if (carried_.contradicted()) out.odometry.health = health_.contradicted();
    return;
  }
  refuse_start(out.odometry);
}

/// One pair of several is enough. With one camera its scale has to be known, too, and the gyroscope's bias be one that the tracks
/// show without a start.
bool Estimator::start_is_good(const TrackedFrame& frame, const Odometry& solved) {
  const bool a_pair_sees = solved.health.reason == HealthReason::one_camera && frame.stats.stereo > 0;
  if (solved.health.state != HealthState::good && !a_pair_sees) return false;
  const Vec3 v_WB = window_.tilt().levelled(window_.newest().state).v_FB;
  if (!one_camera_) return true;
  if (!(scale_sigma_of(v_WB, solved.velocity_covariance) < kMaxScaleSigmaAtStart)) return false;
  const Vec3& gyro_bias_radps = window_.newest().state.bias.gyro_radps;
  if (time_alignment_.off_sigmas(gyro_bias_radps, solved.gyro_bias_covariance) < kMaxBiasSigmasAtStart) return true;
  if (!bias_refused_) bias_refused_ = frame.t;
  return (frame.t - *bias_refused_).seconds() > kBiasRefused_s;
}

/// Nothing of it is published.
void Estimator::refuse_start(Odometry& out) {
  running_ = false;
  calibration_ = calibrated_;
  if (!one_camera_) initialiser_.reset();  // with one camera the same frames and a later one may do
  window_.clear();
  keep_only_stats(out);
  out.health = health_.start_refused();
}

/// The window of a start with one camera goes on, and nothing of it is published until it is seen to be right: a wrong scale
/// shows as a contradiction or a large correction soon after.
void Estimator::stay_on_trial(const TrackedFrame& frame, Estimate& out) {
  Odometry& odometry = out.odometry;
  const bool waited_long = (frame.t - *waiting_since_).seconds() > kWaitedLong_s;
  if (odometry.health.state == HealthState::lost || (!waited_long && odometry.health.reason == HealthReason::contradiction)) {
    trial_.reset();
    refuse_start(odometry);
    initialiser_.reset();
    rest_.reset();
    out.keyframes.clear();
    return;
  }
  published_.follow(motion_of_newest(window_, gravity_G(), monitor_.follows_images()),
                    window_.tilt().levelled(window_.newest().state).T_FB);
  const bool moved = monitor_.take_reset(), moved_along = carried_.take_reset();
  if (moved || moved_along || published_.pending_too_large() || !odometry.health.is_fine()) {
    trial_->good_since = frame.t;
    published_.restart();
  }
  const bool certain = std::sqrt(odometry.velocity_covariance.trace()) < kVelocityOnTrial_mps;  // (O9)
  const double good_s = (frame.t - trial_->good_since).seconds();
  const bool passed = certain && good_s >= (waited_long ? kGoodAtLeast_s : kGoodOnTrial_s);
  if (passed || (frame.t - trial_->since).seconds() > kLongestTrial_s) {
    trial_.reset();
    published_.restart();
    return;
  }
  keep_only_stats(odometry);
  odometry.health = health_.before_start(frame, HealthReason::waiting_for_motion_or_rest);
  out.keyframes.clear();
}

void Estimator::open_window(const InitialSolution& start) {
  window_.clear();
  for (std::size_t i = 0; i < start.frames.size(); ++i) {
    const TrackedFrame& tracked = start.frames[i];
    Frame frame = frame_of_start(start, i, imu_noise_);
    frame.factors = factors_.make({tracked, tracked.features, frame, window_, calibration_, start.from_rest, true});
    window_.add_frame(std::move(frame), tracked.features, calibration_);
  }
  const NavState<G>& first = window_.frames().oldest().state;
  WindowPrior prior = first_frame_prior(first, start.biases);
  if (weights_of(options_).calibrating()) prior = with_calibration_prior(std::move(prior), CalibrationPrior{}, calibrated_);
  window_.set_prior(std::move(prior));
  published_.restart();
  monitor_.restart();
  carried_.begin_window();
  frames_with_readings_ = kFramesAfterGap;
  uncertainty_.restart();
}

}  // namespace fbvins
