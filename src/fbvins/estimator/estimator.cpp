// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/estimator.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fbvins/camera/camera_groups.hpp"
#include "fbvins/core/stage_timer.hpp"
#include "fbvins/estimator/estimator_setup.hpp"
#include "fbvins/estimator/exposures.hpp"
#include "fbvins/estimator/integrity_thresholds.hpp"
#include "fbvins/estimator/window_views.hpp"
#include "fbvins/imu/stamp_noise.hpp"
#include "fbvins/types/protection.hpp"

namespace fbvins {
namespace {

using namespace thresholds;

constexpr double kRestForStandstill_s = 0.5;
/// Share by which an accelerometer's axes and scale are off, of a sensor that was not calibrated up to twice as much.
constexpr double kAxes = 0.015;
/// Rotations and positions, rad and m, that are far below what an image tells: where steps so short no longer help, what is left
/// is a landmark's depth, which the next image's linearisation improves.
constexpr double kWorthLinearising = 1e-5;

}  // namespace

Estimator::Estimator(const StereoRig& rig, const EstimatorOptions& options, const std::optional<ImuState>& before,
                     const std::vector<std::shared_ptr<OwnSensor>>& sensors)
    : options_(for_cameras_of(rig, options)),
      imu_noise_(assumed_noise(rig.imu_noise, options)),
      calibrated_(calibration_of(rig)),
      calibration_(calibrated_),
      one_camera_(!has_stereo(rig)),
      uncertainty_(scale_sigma_of(rig), one_camera_, options.gravity_mps2),
      time_alignment_(rig, options.align_time_offset && !options.estimate_time_offset,
                      before ? before->time_offset : std::nullopt),
      exposures_(rig),
      factors_(rig, options_, sensors),
      initialiser_(options, imu_noise_, before, one_camera_),
      keyframe_policy_(options.keyframes, rig.left().focal_px()),
      health_(options, rig.depth ? 2 : rig.camera_count(), !one_camera_),
      reading_noise_(imu_noise_, options.accel_unmodelled_mps2_rthz > 0 ? kAxes : 0),
      monitor_(imu_noise_, weights_of(options_).calibrating()),
      window_(options_, weights_of(options, !one_camera_)),
      published_(options.max_step_m, options.max_pending_m) {}

StatePrior Estimator::prior() const {
  StatePrior out;
  out.time_offset = time_alignment_.correction();
  if (!running_) return out;
  const Frame& newest = window_.newest();
  return {newest.t, newest.state.T_FB, newest.state.v_FB, newest.state.bias, gravity_G(), true, out.time_offset};
}

WindowSnapshot Estimator::snapshot() const { return snapshot_of(window_, calibration_); }

Vec3 Estimator::gravity_G() const { return window_.tilt().gravity_G(options_.gravity_mps2); }

Estimate Estimator::process(const TrackedFrame& tracked) {
  Estimate out;
  const TrackedFrame& whole = contract_.enforced(tracked, calibration_.camera_count());
  if (time_alignment_.add(whole, running_) && !running_) initialiser_.reset();
  if (!options_.estimate_line_delay) exposures_.correct_line_delay(time_alignment_.line_delay_correction_s());
  const bool as_it_is = exposures_.at_stamp(whole) && !options_.estimate_line_delay;
  if (!as_it_is) referred_ = refer_to_stamp(whole);
  const TrackedFrame& frame = as_it_is ? whole : referred_;
  const Duration rest = rest_.update(frame);
  carried_.carry(frame.t, frame.imu);
  if (!frame.imu.empty()) last_rate_ = frame.imu.samples.back().gyro_radps;
  if (running_) track(frame, rest, out);
  else initialise(frame, rest, out);
  if (trial_) stay_on_trial(frame, out);
  Odometry& odometry = out.odometry;
  odometry.id = frame.id;
  odometry.t = frame.t;
  odometry.time_offset_s = time_alignment_.correction().seconds();
  odometry.time_offset_sigma_s = time_alignment_.sigma_s();
  const bool is_public = running_ && !trial_;
  if (is_public) {
    waiting_since_.reset();
    publish(odometry);
  }
  odometry.reset_counter = reset_counter_;
  if (is_public) carried_.remember(window_, odometry, reading_noise_.clipped());
  if (odometry.health.state == HealthState::lost) restart();
  health_.pass(frame);
  out.landmarks = {next_update_++, reset_counter_, window_.known().take_new()};
  return out;
}

/// From here on each observation knows when and from where it was seen (S1-S4).
TrackedFrame Estimator::refer_to_stamp(const TrackedFrame& frame) const {
  TrackedFrame out = frame;
  std::optional<Vec3> gravity_B;
  ImuBias bias;
  if (running_) {
    const NavState<G> state = predict(frame, frame.imu).state;
    gravity_B = state.T_FB.q.conjugate() * gravity_G();
    bias = state.bias;
  }
  exposures_.refer_to_stamp(ExposureMotion(frame.imu, bias, gravity_B), calibration_, out);
  return out;
}

Frame Estimator::predict(const TrackedFrame& frame, const ImuSegment& readings) const {
  const Frame& last = window_.newest();
  Frame f = without_state(frame);
  if (readings.empty()) {  // constant velocity
    f.state = last.state;
    f.state.T_FB.p += (frame.t - last.t).seconds() * last.state.v_FB;
    return f;
  }
  Preintegration imu(imu_noise_, last.state.bias);
  imu.integrate(readings);
  f.state = imu.predict(last.state, gravity_G());
  // With one camera the readings alone give the scale, and stamps that are taken to be exact spoil it.
  const bool velocity_known = frames_with_readings_ >= kFramesAfterGap;
  if (one_camera_ && velocity_known && !frame.features.empty())
    imu.loosen_end(std::sqrt(2.0) * kUnseenStampNoise_s, f.state, gravity_G());
  f.imu = std::make_shared<const Preintegration>(std::move(imu));
  return f;
}

void Estimator::track(const TrackedFrame& frame, Duration rest, Estimate& out) {
  EstimatorStats& stats = out.odometry.stats;
  CpuTimer timer;
  const bool standstill = rest.seconds() > kRestForStandstill_s;
  const Duration dt = frame.t - window_.newest().t;
  ImuSegment imu = frame.imu;
  imu.noise = reading_noise_.of(imu);
  if (!frame.features.empty()) {
    const NavState<G>& last = window_.newest().state;
    add_stamp_noise(imu, imu_noise_, time_alignment_.stamp_sigma_s(), last_rate_ - last.bias.gyro_radps, last.v_FB);
  }
  Frame predicted = predict(frame, imu);
  const std::vector<TrackedFeature> features = check_readings(frame, imu, predicted);
  out.imu_noise = imu.noise;
  predicted.factors = factors_.make({frame, features, predicted, window_, calibration_, standstill});
  window_.add_frame(std::move(predicted), features, calibration_);
  stats.prepare_ms = timer.lap_ms();
  const WindowSolution& solution =
      solve(out.odometry, LmOptions{.max_iterations = options_.max_iterations, .worth_linearising = kWorthLinearising});
  timer.lap_ms();
  stats.standstill = standstill;
  stats.keyframe = keyframe_policy_.is_keyframe(window_, calibration_, standstill);
  window_.make_newest_keyframe(stats.keyframe);
  if (time_alignment_.settling()) monitor_.forget_biases();
  monitor_.take({frame.t, window_.newest().state.bias, out.odometry.gyro_bias_covariance, out.odometry.accel_bias_covariance});
  monitor_.take(turns_of(window_.frames()), window_.newest().state.T_FB, dt);
  compare_carried(out.odometry);
  out.odometry.health = judge(frame, out.odometry);
  if (out.odometry.health.has_pose()) shrink_window(solution, out);
  stats.marginalise_ms = timer.lap_ms();
}

/// Compares images and readings, and returns the features of the cameras that agree. Readings that the images
/// contradict count less.
std::vector<TrackedFeature> Estimator::check_readings(const TrackedFrame& frame, ImuSegment& imu, Frame& predicted) {
  wrong_cameras_ = 0;
  const Duration dt = frame.t - window_.newest().t;
  // After a gap the images have to say first how fast the vehicle is.
  frames_with_readings_ = imu.empty() || imu.longest_gap.seconds() > kReadingsGap_s ? 0 : frames_with_readings_ + 1;
  if (frames_with_readings_ < kFramesAfterGap) {
    monitor_.pass(dt);
    return frame.features;
  }
  monitor_.expect({time_alignment_.stamp_sigma_s(), one_camera_ ? uncertainty_.velocity_sigma_mps() : 0, imu.noise});
  const ConsistencyMonitor::Verdict verdict = monitor_.check(landmark_observations(window_, frame.features, calibration_),
                                                             calibration_, predicted.state.T_FB, dt, predicted.state.v_B());
  if (verdict.noise.gyro > imu.noise.gyro || verdict.noise.accel > imu.noise.accel) {
    imu.noise.gyro = std::max(imu.noise.gyro, verdict.noise.gyro);
    imu.noise.accel = std::max(imu.noise.accel, verdict.noise.accel);
    predicted = predict(frame, imu);
  }
  if (verdict.imu_contradicts) predicted.state.T_FB = *verdict.seen;
  if (verdict.wrong == 0) return frame.features;
  wrong_cameras_ = verdict.wrong;
  return without_cameras(frame.features, verdict.wrong);
}

const WindowSolution& Estimator::solve(Odometry& out, const LmOptions& lm) {
  CpuTimer timer;
  window_.fill_problem(calibration_, solution_.window);
  solver_.solve(solution_, lm);
  if (!solution_.summary.usable &&
      window_.refuse_landmark_priors(solution_.window) > 0) {  // a wrong one can make every step fail
    window_.fill_problem(calibration_, solution_.window);
    solver_.solve(solution_, lm);
  }
  const WindowProblem& solved = solution_.window;
  const LmSummary& summary = solution_.summary;
  if (summary.usable) {
    window_.refuse_landmark_priors(solved);
    window_.take_estimates(solved);
    calibration_ = solved.calibration;
    fill_covariances(solution_, out);
    out.stats.outliers += window_.remove_outliers(solved);
  }
  failed_solves_ = summary.usable ? 0 : failed_solves_ + 1;
  out.stats.frames_in_window = window_.frames().size();
  out.stats.landmarks = static_cast<int>(solved.landmarks.size());
  out.stats.known_landmarks = static_cast<int>(solved.landmark_priors.size());
  out.stats.observations = static_cast<int>(solved.observations.size());
  out.stats.iterations += summary.iterations;
  out.stats.initial_cost = summary.initial_cost;
  out.stats.final_cost = summary.final_cost;
  out.stats.solve_ms += timer.lap_ms();
  return solution_;
}

void Estimator::fill_covariances(const WindowSolution& solution, Odometry& out) {
  const Frame& newest = window_.newest();
  std::optional<Mat17> covariance = solution.covariance(newest.id);
  if (!covariance) return;
  KnownLandmarks& known = window_.known();
  known.set_active_priors(newest.state.T_FB.p, solution.window.landmark_priors);
  covariance->topLeftCorner<6, 6>() = known.with_map_covariance(newest.state.T_FB, covariance->topLeftCorner<6, 6>());
  uncertainty_.fill(*covariance, newest.state, window_.tilt(), mean_rate_B(window_.frames()), out);
}

void Estimator::shrink_window(const WindowSolution& solution, Estimate& out) {
  out.keyframes = keyframe_policy_.take_final(window_, solution, calibration_);
  for (Keyframe& keyframe : out.keyframes) {
    keyframe.scale_sigma = uncertainty_.scale_sigma();
    keyframe.reset_counter = reset_counter_;
  }
  keyframe_policy_.shrink(window_, solution, calibration_);
  out.odometry.stats.frames_in_window = window_.frames().size();
}

bool Estimator::contradicted_too_long(Time t) {
  const double step_s = (t - std::exchange(judged_, t)).seconds();
  if (!one_camera_ || !monitor_.follows_images()) contradicted_s_ = 0;
  else contradicted_s_ = std::max(0.0, contradicted_s_ + (monitor_.contradicts_now() ? step_s : -step_s));
  return contradicted_s_ > kContradictedOneCamera_s;
}

Health Estimator::judge(const TrackedFrame& frame, const Odometry& solved) {
  return health_.judge(frame, window_.newest().state, landmarks_in_view(window_),
                       {.worst_sigma_m = worst_sigma_m(solved.pose_covariance),
                        .failed_solves = failed_solves_,
                        .broken_features = contract_.broken(),
                        .contradiction = monitor_.contradicted() || carried_.contradicted(),
                        .unrecoverable = monitor_.unrecoverable() || contradicted_too_long(frame.t),
                        .wrong_cameras = wrong_cameras_,
                        .after_gap = frames_with_readings_ < kFramesAfterGap,
                        .after_dark = monitor_.settling(),
                        .clipped = reading_noise_.clipped(),
                        .doubted_sensor = factors_.doubt(),
                        .gyro_vibration_radps = reading_noise_.gyro_vibration_radps()});
}

void Estimator::compare_carried(const Odometry& solved) {
  carried_.compare(window_, {solved, gravity_G(), uncertainty_.up_sigma_rad(), reading_noise_.clipped(), monitor_.contradicted(),
                             monitor_.bias_suspected()});
}

/// The pose goes on, but nobody knows any more how it lies in the W of before: told by the reset counter.
void Estimator::begin_new_W() {
  published_.restart();
  window_.forget_known();
  ++reset_counter_;
}

void Estimator::restart() {
  carried_.restart(monitor_.contradicted());
  const Pose<W, B>& last = published_.T_WB();
  // The next gauge begins where this W ends, so that the pose goes on from where it was published last.
  if (last.p.allFinite() && last.q.coeffs().allFinite()) restart_pose_ = last.cast_frames<G, B>();
  running_ = false;
  calibration_ = calibrated_;
  bias_refused_.reset();
  trial_.reset();
  failed_solves_ = 0;
  ++reset_counter_;
  window_.clear();
  initialiser_.reset();
  rest_.reset();
}

/// A large pending correction is published at once, as a new W, if the pose was not good shortly before, or if it is twice the
/// limit (W24). Otherwise it is published in steps, and the pose is not good meanwhile: a fast flight whose tilt becomes known
/// far from its start.
void Estimator::apply_or_defer_correction(const Pose<W, B>& level, Odometry& out) {
  const bool after_trouble = last_trouble_ && (out.t - *last_trouble_).seconds() < kTrouble_s;
  if (!after_trouble && !published_.pending_too_large(kAtOnce)) {
    out.health = health_.corrected(HealthEvidence::Correction::pending);
    return;
  }
  begin_new_W();
  published_.follow({}, level);
  monitor_.count_reset();
  if (!after_trouble) return;
  monitor_.doubt_tilt();
  out.health = health_.corrected(HealthEvidence::Correction::made);
}

/// Publishes the pose of the newest frame, continuing from the one published before (W17-W20).
void Estimator::publish(Odometry& out) {
  const NavState<G>& newest = window_.newest().state;
  const NavState<W> level = window_.tilt().levelled(newest);
  carried_.fill_covariances(out);
  const bool moved_along = !monitor_.contradicted() && carried_.take_reset();
  if (monitor_.take_reset() || moved_along) begin_new_W();
  published_.follow(motion_of_newest(window_, gravity_G(), monitor_.follows_images()), level.T_FB);
  if (out.health.is_fine() && published_.pending_too_large()) apply_or_defer_correction(level.T_FB, out);
  if (!out.health.is_fine() && out.health.reason != HealthReason::correction_pending) last_trouble_ = out.t;
  // These are in the axes of G; the tilt between G and W is small against a doubt.
  out.pose_covariance += monitor_.doubt(newest.T_FB);
  out.velocity_covariance += monitor_.velocity_doubt(newest.v_FB);
  carried_.add_doubt(out);
  published_.fill(level, out);
  out.gauge = gauge_state_of(window_, newest);
  out.gauge.up_sigma_rad = uncertainty_.up_sigma_rad();
  out.bias = level.bias;
  out.w_WB_B = last_rate_ - level.bias.gyro_radps;
}

}  // namespace fbvins
