// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/estimator.hpp"

#include <utility>

#include "fbvins/core/stage_timer.hpp"
#include "fbvins/estimator/initial_prior.hpp"
#include "fbvins/imu/propagation.hpp"

namespace fbvins {
namespace {

constexpr double kRestForStandstill_s = 0.5;
constexpr double kImuGapDegraded_s = 0.05;
constexpr int kFailedSolvesUntilLost = 3;

ImuNoise scaled(ImuNoise noise, const EstimatorOptions& o) {
  noise.gyro_noise_density_radps_rthz *= o.gyro_noise_scale;
  noise.accel_noise_density_mps2_rthz *= o.accel_noise_scale;
  noise.gyro_random_walk_radps2_rthz *= o.gyro_walk_scale;
  noise.accel_random_walk_mps3_rthz *= o.accel_walk_scale;
  return noise;
}

}  // namespace

Estimator::Estimator(const StereoRig& rig, const EstimatorOptions& options)
    : options_(options),
      rig_(rig),
      imu_noise_(scaled(rig.imu_noise, options)),
      calibration_{rig.T_BC0, rig.T_BC1, 0.0},
      initialiser_(options, imu_noise_),
      rest_(RestDetectorOptions{.max_motion_px = options.initialiser.max_rest_motion_px}),
      keyframe_policy_(options.keyframes, rig.left.focal_px()),
      window_(options) {}

WindowWeights Estimator::weights() const {
  WindowWeights w;
  w.huber_sigma = options_.huber_sigma;
  w.gravity_mps2 = options_.gravity_mps2;
  w.standstill_velocity_sigma_mps = options_.standstill_velocity_sigma_mps;
  w.min_inverse_depth_1pm = 1.0 / options_.max_depth_m;
  w.estimate_tilt = estimates_tilt_;
  w.estimate_extrinsics = options_.estimate_extrinsics;
  w.estimate_time_offset = options_.estimate_time_offset;
  return w;
}

StatePrior Estimator::prior() const {
  StatePrior out;
  if (!running_) return out;
  const Frame& newest = window_.newest();
  return {newest.t, newest.state.T_WB, newest.state.v_WB, newest.state.bias, gravity_W(), true};
}

Vec3 Estimator::gravity_W() const { return window_.tilt().gravity_W(options_.gravity_mps2); }

Estimate Estimator::process(const TrackedFrame& frame) {
  keyframes_.clear();
  window_.remember_landmarks(options_.known_landmarks.enabled);
  const Duration rest = rest_.update(frame);
  Odometry out = running_ ? track(frame, rest) : initialise(frame, rest);
  out.id = frame.id;
  out.t = frame.t;
  if (running_) fill(out);
  out.reset_counter = reset_counter_;
  if (out.health.state == HealthState::lost) restart();
  previous_frame_ = frame.t;
  return {std::move(out), std::exchange(keyframes_, {}), {next_update_++, reset_counter_, window_.known().take_new()}};
}

Odometry Estimator::initialise(const TrackedFrame& frame, Duration rest) {
  Odometry out;
  CpuTimer timer;
  std::optional<InitialSolution> start = initialiser_.process(frame, rest, calibration_, restart_pose_);
  out.stats.prepare_ms = timer.lap_ms();
  if (!start) {
    out.health = {HealthState::initialising, initialiser_.reason()};
    return out;
  }
  window_.clear();
  estimates_tilt_ = window_.remembers_landmarks();
  for (std::size_t i = 0; i < start->frames.size(); ++i) {
    Frame f;
    f.id = start->frames[i].id;
    f.t = start->frames[i].t;
    f.state = start->states[i];
    f.keyframe = start->from_rest ? i == 0 : i % 2 == 0;
    f.standstill = start->from_rest;
    f.images = start->frames[i].images;
    if (i > 0) {
      f.imu.emplace(imu_noise_, f.state.bias);
      f.imu->integrate(start->frames[i].imu);
    }
    window_.add_frame(std::move(f), start->frames[i].features, calibration_);
  }
  WindowPrior belief = first_frame_prior(options_.initialiser, window_.frames().front().state, estimates_tilt_);
  if (options_.estimate_extrinsics || options_.estimate_time_offset)
    belief = with_calibration_belief(std::move(belief), options_.calibration, {rig_.T_BC0, rig_.T_BC1, 0.0});
  window_.set_prior(std::move(belief));
  window_.set_pivot(window_.frames().front().state.T_WB.p);
  // Tilt, velocity and biases hardly move the cost of so short a time: do not stop on its decrease.
  const LmOptions thorough{.max_iterations = 30, .min_decrease = 1e-9};
  running_ = true;
  last_good_tracking_ = frame.t;
  solve(out, thorough);
  // The first solve may have moved the first frame far: Jacobians of the prior follow it.
  window_.restart_first_estimates();
  solve(out, thorough);
  out.health = judge(frame);
  if (out.health.state != HealthState::good) {
    running_ = false;
    initialiser_.reset();
    out.health = {HealthState::initialising, HealthReason::alignment_refused};
    return out;
  }
  shrink_window(out);
  return out;
}

Frame Estimator::predict(const TrackedFrame& frame) const {
  const Frame& last = window_.newest();
  Frame f;
  f.id = frame.id;
  f.t = frame.t;
  f.images = frame.images;
  if (frame.imu.empty()) {  // no reading at all: carry on with the velocity
    f.state = last.state;
    f.state.T_WB.p += (frame.t - last.t).seconds() * last.state.v_WB;
    return f;
  }
  f.imu.emplace(imu_noise_, last.state.bias);
  f.imu->integrate(frame.imu);
  f.state = f.imu->predict(last.state, gravity_W());
  return f;
}

Odometry Estimator::track(const TrackedFrame& frame, Duration rest) {
  Odometry out;
  CpuTimer timer;
  const bool standstill = rest.seconds() > kRestForStandstill_s;
  Frame predicted = predict(frame);
  predicted.standstill = standstill;
  if (!frame.imu.empty()) last_rate_ = frame.imu.samples.back().gyro_radps;
  window_.add_frame(std::move(predicted), frame.features, calibration_);
  out.stats.prepare_ms = timer.lap_ms();
  solve(out, LmOptions{.max_iterations = options_.max_iterations});
  timer.lap_ms();
  out.stats.standstill = standstill;
  choose_keyframe(standstill, out);
  out.health = judge(frame);
  if (out.health.has_pose()) shrink_window(out);
  out.stats.marginalise_ms = timer.lap_ms();
  return out;
}

void Estimator::solve(Odometry& out, const LmOptions& lm) {
  CpuTimer timer;
  window_.build(problem_, calibration_, weights());
  LmSummary summary = problem_.optimise(lm);
  if (!summary.usable && window_.refuse_beliefs(problem_) > 0) {  // one of them can make every step worse
    window_.build(problem_, calibration_, weights());
    summary = problem_.optimise(lm);
  }
  if (summary.usable) {
    window_.refuse_beliefs(problem_);
    window_.accept(problem_);
    calibration_ = problem_.calibration;
    failed_solves_ = 0;
  } else {
    ++failed_solves_;
  }
  if (summary.usable) fill_covariances(out);
  out.stats.frames_in_window = static_cast<int>(window_.frames().size());
  out.stats.landmarks = static_cast<int>(problem_.landmarks.size());
  out.stats.known_landmarks = static_cast<int>(problem_.beliefs.size());
  out.stats.observations = static_cast<int>(problem_.observations.size());
  out.stats.iterations += summary.iterations;
  out.stats.initial_cost = summary.initial_cost;
  out.stats.final_cost = summary.final_cost;
  out.stats.outliers += summary.usable ? window_.remove_outliers(problem_, options_.outlier_sigma) : 0;
  out.stats.solve_ms += timer.lap_ms();
}

void Estimator::fill_covariances(Odometry& out) {
  Mat17 covariance;
  if (!problem_.covariance(static_cast<int>(window_.frames().size()) - 1, covariance)) return;
  const NavState& state = window_.newest().state;
  KnownLandmarks& known = window_.known();
  known.hold_to(state.T_WB.p, problem_.beliefs);
  covariance.topLeftCorner<6, 6>() = known.with_map(state.T_WB, covariance.topLeftCorner<6, 6>());
  const Mat15 level = window_.tilt().levelled_covariance(state, covariance);
  out.pose_covariance = level.topLeftCorner<6, 6>();
  out.velocity_covariance = level.block<3, 3>(nav::v, nav::v);
  out.gyro_bias_covariance = level.block<3, 3>(nav::bg, nav::bg);
  out.accel_bias_covariance = level.block<3, 3>(nav::ba, nav::ba);
}

void Estimator::choose_keyframe(bool standstill, Odometry& out) {
  const bool keyframe = keyframe_policy_.is_keyframe(window_, calibration_, standstill);
  window_.newest().keyframe = keyframe;
  out.stats.keyframe = keyframe;
}

void Estimator::shrink_window(Odometry& out) {
  const auto keyframe_zone = [&] { return static_cast<int>(window_.frames().size()) - options_.keyframes.newest_frames; };
  // While problem_ still is this window's:
  hand_on_keyframes(keyframe_zone());
  if (Mat17 covariance; keyframe_zone() > options_.keyframes.max_keyframes && problem_.covariance(0, covariance))
    window_.known().anchor(window_.frames()[0].state.T_WB, covariance.topLeftCorner<6, 6>());
  for (int i = keyframe_zone() - 1; i >= 1; --i)
    if (!window_.frames()[i].keyframe) window_.drop_frame(i, problem_, calibration_, weights());
  while (keyframe_zone() > options_.keyframes.max_keyframes) {
    int leaving = 0;
    if (options_.keyframes.leaving != "oldest") {
      window_.build(problem_, calibration_, weights());
      leaving = keyframe_policy_.leaving(problem_, keyframe_zone());
    }
    window_.marginalise_keyframe(leaving, problem_, calibration_, weights());
  }
  out.stats.frames_in_window = static_cast<int>(window_.frames().size());
}

void Estimator::hand_on_keyframes(int keyframe_zone) {
  for (int i = 0; i < keyframe_zone; ++i) {
    const Frame& frame = window_.frames()[i];
    if (!frame.keyframe || frame.id <= newest_handed_on_) continue;
    newest_handed_on_ = frame.id;
    Keyframe keyframe = window_.take_keyframe(i, calibration_);
    Mat17 covariance;
    if (problem_.covariance(i, covariance))
      keyframe.pose_covariance = window_.tilt().levelled_covariance(frame.state, covariance).topLeftCorner<6, 6>();
    keyframe.reset_counter = reset_counter_;
    keyframes_.push_back(std::move(keyframe));
  }
}

Health Estimator::judge(const TrackedFrame& frame) {
  const NavState& state = window_.newest().state;
  const int in_view = window_.landmarks_in_view();
  if (in_view >= options_.min_tracks) last_good_tracking_ = frame.t;
  const Duration blind = frame.t - last_good_tracking_.value_or(frame.t);
  const bool no_imu = frame.imu.empty() && previous_frame_.has_value();

  if (!state.T_WB.p.allFinite() || failed_solves_ >= kFailedSolvesUntilLost)
    return {HealthState::lost, HealthReason::solver_failed};
  if (state.v_WB.norm() > options_.max_speed_mps) return {HealthState::lost, HealthReason::implausible_speed};
  if (state.bias.gyro_radps.norm() > options_.max_gyro_bias_radps || state.bias.accel_mps2.norm() > options_.max_accel_bias_mps2)
    return {HealthState::lost, HealthReason::implausible_bias};
  if (blind.seconds() > options_.max_image_gap_s) return {HealthState::lost, HealthReason::no_tracks};
  if (no_imu && in_view < options_.min_tracks) return {HealthState::lost, HealthReason::imu_gap};
  if (frame.imu.longest_gap.seconds() > options_.max_imu_gap_s && in_view < options_.min_tracks)
    return {HealthState::lost, HealthReason::imu_gap};
  if (failed_solves_ > 0) return {HealthState::degraded, HealthReason::solver_failed};
  if (no_imu || frame.imu.longest_gap.seconds() > kImuGapDegraded_s) return {HealthState::degraded, HealthReason::imu_gap};
  if (in_view == 0) return {HealthState::degraded, HealthReason::no_tracks};
  if (in_view < options_.min_tracks) return {HealthState::degraded, HealthReason::few_tracks};
  if (frame.stats.stereo == 0) return {HealthState::degraded, HealthReason::one_camera};
  return {HealthState::good, HealthReason::none};
}

void Estimator::restart() {
  const Pose<W, B> last = window_.tilt().levelled(window_.newest().state.T_WB);
  if (last.p.allFinite() && last.q.coeffs().allFinite()) restart_pose_ = last;
  running_ = false;
  failed_solves_ = 0;
  ++reset_counter_;
  window_.clear();
  initialiser_.reset();
  rest_.reset();
}

void Estimator::fill(Odometry& out) {
  const NavState state = window_.tilt().levelled(window_.newest().state);
  out.T_WB = state.T_WB;
  out.v_WB = state.v_WB;
  out.bias = state.bias;
  out.w_WB_B = last_rate_ - state.bias.gyro_radps;
}

}  // namespace fbvins
