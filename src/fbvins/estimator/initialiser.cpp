// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/initialiser.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "fbvins/estimator/initial_prior.hpp"
#include "fbvins/estimator/mono_start.hpp"
#include "fbvins/estimator/pose_refinement.hpp"
#include "fbvins/estimator/window_views.hpp"
#include "fbvins/geometry/heading.hpp"
#include "fbvins/imu/aged_bias.hpp"
#include "fbvins/imu/alignment.hpp"
#include "fbvins/imu/propagation.hpp"
#include "fbvins/imu/static_initialiser.hpp"

namespace fbvins {
namespace {

/// An initial solution is made from so many images, at least this far apart.
constexpr int kFrames = 10;
constexpr double kMinSpacing_s = 0.045;
/// With one camera, of which scale and gravity have to be told apart by the accelerations meanwhile.
constexpr double kMinSpacingOneCamera_s = 0.25;
/// Where the motion is strong, a second of it is enough, and a cheap IMU's errors are small in it.
constexpr double kMinSpacingStrong_s = 0.1;
/// Images of a pair that are taken farther apart show no structure while the velocity is not known: the motion is found like with
/// one camera.
constexpr Duration kMostApart = Duration{2'000'000};
/// Stereo features, or features of the one camera, needed in each of them. At rest motion is known without them, and fewer are
/// enough: the floor in front of a landed drone shows few.
constexpr int kMinFeatures = 20, kMinFeaturesAtRest = 8;
/// At rest a track that is farther than this from its first pixel is on a moving object.
constexpr double kStill_px = 1.5;
constexpr int kMinStructureInliers = 12;
constexpr double kMinInlierShare = 0.6;
/// Images in which one camera is missing are passed over, for this long at most.
constexpr double kLongestSkip_s = 0.15;
constexpr std::size_t kFramesPerRefinement = 3;

/// Prior on all fifteen numbers of the first frame: images alone determine neither origin nor velocity.
WindowPrior held_still() {
  WindowPrior prior;
  prior.frames = {0};
  prior.quadratic.g = Eigen::VectorXd::Zero(15);
  prior.quadratic.H = 1e6 * Eigen::MatrixXd::Identity(15, 15);
  return prior;
}

/// Removes tracks on moving objects, for a vehicle at rest: those that have left their first pixel.
void leave_out_moving(std::vector<TrackedFrame>& frames) {
  std::unordered_map<TrackId, Vec2> first;
  std::unordered_set<TrackId> moving;
  for (const TrackedFrame& frame : frames)
    for (const TrackedFeature& f : frame.features)
      if (const Observation* o = f.by(f.lead);
          o && (o->pixel - first.try_emplace(f.id, o->pixel).first->second).norm() > kStill_px)
        moving.insert(f.id);
  for (TrackedFrame& frame : frames)
    std::erase_if(frame.features, [&](const TrackedFeature& f) { return moving.contains(f.id); });
}

/// Consecutive segments as one; neighbours share a stamp.
ImuSegment joined(ImuSegment first, const ImuSegment& second) {
  if (first.empty()) return second;
  first.samples.insert(first.samples.end(), second.samples.begin() + 1, second.samples.end());
  first.longest_gap = std::max(first.longest_gap, second.longest_gap);
  first.noise = {std::max(first.noise.gyro, second.noise.gyro), std::max(first.noise.accel, second.noise.accel)};
  return first;
}

/// Rotates about the vertical and translates G so that the first state has the position and heading of `origin`.
void move_to(const Pose<G, B>& origin, InitialSolution& start) {
  const Pose<G, B> first = start.states.front().T_FB;
  const Quat turn(Eigen::AngleAxisd(heading_between(first.q, origin.q), Vec3::UnitZ()));
  for (NavState<G>& s : start.states) {
    s.T_FB = {(turn * s.T_FB.q).normalized(), Vec3(origin.p + turn * (s.T_FB.p - first.p))};
    s.v_FB = turn * s.v_FB;
  }
}

std::optional<LevelStand> stand_of(const StandingOptions& o) {
  const Vec3 up_B(o.up_x, o.up_y, o.up_z);
  if (o.tilt_rad == 0 || up_B.isZero(0)) return std::nullopt;
  return LevelStand{up_B.normalized(), o.tilt_rad};
}

}  // namespace

void SpacedFrames::add(TrackedFrame frame, double spacing_s) {
  // With a fast camera the frames would span too short a time: the newest replaces one that is too close to its predecessor.
  const std::size_t n = frames_.size();
  if (n >= 2 && (frame.t - frames_[n - 2].t).seconds() < spacing_s) {
    frame.imu = joined(std::move(frames_.back().imu), frame.imu);
    frames_.pop_back();
  }
  frames_.push_back(std::move(frame));
  while (static_cast<int>(frames_.size()) > kFrames) frames_.pop_front();
}

bool SpacedFrames::full() const { return static_cast<int>(frames_.size()) >= kFrames; }

Initialiser::Initialiser(const EstimatorOptions& options, const ImuNoise& noise, const std::optional<ImuState>& before,
                         bool one_camera)
    : gravity_mps2_(options.gravity_mps2),
      noise_(noise),
      before_(before),
      stand_(stand_of(options.standing)),
      one_camera_(one_camera),
      structure_(options, WindowWeights{.estimate_tilt = false}) {}

/// Whether structure cannot be seen in one frame of a body in motion.
bool Initialiser::by_one_camera(const TrackedFrame& frame) const { return one_camera_ || frame.offsets.longest() > kMostApart; }

/// By which the motion can be found.
int Initialiser::usable_features(const TrackedFrame& frame, bool at_rest) const {
  const bool lead_alone = at_rest ? one_camera_ : by_one_camera(frame);
  return static_cast<int>(std::ranges::count_if(
      frame.features, [&](const TrackedFeature& f) { return f.by(f.lead) && (lead_alone || f.by_several()); }));
}

std::optional<InitialSolution> Initialiser::process(const TrackedFrame& frame, Duration rest, const Calibration& calibration,
                                                    const std::optional<Pose<G, B>>& origin) {
  // After a break in the images or readings the earlier frames are of no use: frames must be consecutive.
  const bool broken = !frames_.all().empty() && frame.imu.empty();
  const bool at_rest = rest.seconds() >= RestOptions{}.min_window_s;
  const bool incomplete = !(frame.has(0) && frame.has(1)) && !broken && !frames_.all().empty() &&
                          (frame.t - frames_.all().back().t).seconds() < kLongestSkip_s;
  if (incomplete && usable_features(frame, at_rest) < kMinFeaturesAtRest) {
    skipped_ = joined(std::move(skipped_), frame.imu);
    readings_.push_back(frame.imu);
    return std::nullopt;
  }
  if (usable_features(frame, at_rest) < (at_rest ? kMinFeaturesAtRest : kMinFeatures) || broken) {
    reason_ = HealthReason::too_few_features;
    reset();
    if (!broken) return std::nullopt;
  }
  remember(frame, at_rest);
  std::optional<InitialSolution> start;
  ImuBiasEstimate biases = before_ ? aged(*before_, frame.t, noise_) : unknown_biases();
  if (stand_ && !origin) biases = as_it_stands(biases, at_rest);
  if (at_rest && one_camera_) reason_ = HealthReason::waiting_for_motion_or_rest;  // rest shows no scale
  else if (at_rest) start = start_from_rest(biases);
  else if (frames_.full() || near_.full()) start = start_in_motion(biases, calibration);
  else reason_ = HealthReason::waiting_for_motion_or_rest;
  if (start) start->biases = biases;
  if (start && origin) move_to(*origin, *start);
  return start;
}

void Initialiser::remember(const TrackedFrame& frame, bool at_rest) {
  if (!frame.imu.empty()) readings_.push_back(frame.imu);
  while (readings_.size() > 1 && (frame.t - readings_[1].samples.front().t).seconds() >= RestOptions{}.min_window_s)
    readings_.pop_front();
  TrackedFrame newest = frame;
  newest.imu = joined(std::exchange(skipped_, {}), frame.imu);
  const bool slowly = one_camera_ || (by_one_camera(frame) && !at_rest);
  if (slowly) near_.add(newest, kMinSpacingStrong_s);
  frames_.add(std::move(newest), slowly ? kMinSpacingOneCamera_s : kMinSpacing_s);
}

std::vector<ImuSample> Initialiser::newest_readings() const {
  std::vector<ImuSample> readings;
  for (const ImuSegment& segment : readings_)
    readings.insert(readings.end(), segment.samples.begin() + (readings.empty() ? 0 : 1),
                    segment.samples.end());  // neighbours share a stamp
  return readings;
}

/// What is a gap the segments say, as a slow IMU's own steps are none.
RestOptions Initialiser::rest_options() const {
  RestOptions options;
  const auto has_gap = [&](const ImuSegment& s) { return s.longest_gap.seconds() > options.max_gap_s; };
  if (std::ranges::none_of(readings_, has_gap)) options.max_gap_s = options.min_window_s;
  return options;
}

/// While it stands the floor tells the accelerometer's bias, which is then known when the start comes.
ImuBiasEstimate Initialiser::as_it_stands(const ImuBiasEstimate& prior, bool at_rest) {
  if (at_rest) {
    const RestEstimate rest = initialise_at_rest(newest_readings(), noise_, rest_options(), gravity_mps2_);
    if (rest.at_rest) stood_ = standing_bias(prior, rest.force_mps2, *stand_, gravity_mps2_);
  }
  return stood_.value_or(prior);
}

std::optional<InitialSolution> Initialiser::start_from_rest(const ImuBiasEstimate& biases) {
  std::vector<ImuSample> readings = newest_readings();
  for (ImuSample& reading : readings) reading.accel_mps2 -= biases.bias.accel_mps2;
  RestEstimate rest = initialise_at_rest(readings, noise_, rest_options(), gravity_mps2_);
  if (!rest.at_rest) {
    reason_ = HealthReason::waiting_for_motion_or_rest;
    return std::nullopt;
  }
  rest.state.bias.accel_mps2 = biases.bias.accel_mps2;
  InitialSolution start{
      {frames_.all().begin(), frames_.all().end()}, std::vector<NavState<G>>(frames_.all().size(), rest.state), true, {}};
  leave_out_moving(start.frames);
  return start;
}

std::optional<InitialSolution> Initialiser::start_in_motion(const ImuBiasEstimate& biases, const Calibration& calibration) {
  if (by_one_camera(frames_.all().back())) {
    reason_ = frames_.full() ? HealthReason::alignment_refused : HealthReason::waiting_for_motion_or_rest;
    std::optional<InitialSolution> start = start_with_one_camera(frames_, biases, calibration);
    return start ? start : start_with_one_camera(near_, biases, calibration);
  }
  std::vector<Pose<G, B>> poses;
  if (!stereo_structure(calibration, poses)) {
    reason_ = HealthReason::too_few_features;
    return std::nullopt;
  }
  std::vector<Pose<VisualWorld, B>> visual_poses;
  std::vector<Preintegration> between;
  for (std::size_t i = 0; i < frames_.all().size(); ++i) {
    visual_poses.push_back(poses[i].cast_frames<VisualWorld, B>());  // the structure's gauge is arbitrary
    if (i > 0) between.emplace_back(noise_, ImuBias{}).integrate(frames_.all()[i].imu);
  }
  AlignmentOptions options;
  options.accel_bias_mps2 = biases.bias.accel_mps2;
  options.accel_bias_prior_mps2 =
      std::min(options.accel_bias_prior_mps2, std::sqrt(biases.accel_covariance.diagonal().maxCoeff()));
  AlignmentResult alignment = align_visual_inertial(visual_poses, between, options, gravity_mps2_);
  if (!alignment.accepted) {
    reason_ = HealthReason::alignment_refused;
    return std::nullopt;
  }
  return InitialSolution{{frames_.all().begin(), frames_.all().end()}, std::move(alignment.states), false, {}};
}

std::optional<InitialSolution> Initialiser::start_with_one_camera(const SpacedFrames& spaced, const ImuBiasEstimate& biases,
                                                                  const Calibration& calibration) {
  if (!spaced.full()) return std::nullopt;
  const std::vector<TrackedFrame> frames(spaced.all().begin(), spaced.all().end());
  std::optional<std::vector<NavState<G>>> states =
      fbvins::start_with_one_camera(frames, calibration.T_BC0(), noise_, biases, gravity_mps2_);
  if (!states) return std::nullopt;
  return InitialSolution{frames, std::move(*states), false, {}};
}

bool Initialiser::refine_structure(const Calibration& calibration) {
  WindowSolution solution;
  structure_.fill_problem(calibration, solution.window);
  solver_.solve(solution, LmOptions{.max_iterations = 6});
  if (!solution.summary.usable) return false;
  structure_.take_estimates(solution.window);
  structure_.remove_outliers(solution.window);
  return true;
}

bool Initialiser::stereo_structure(const Calibration& calibration, std::vector<Pose<G, B>>& poses) {
  // Poses in a visual world whose origin is the first frame, first one by one, then all together.
  poses.assign(1, Pose<G, B>{});
  std::unordered_map<TrackId, Vec3> points;
  structure_.clear();
  for (std::size_t i = 0; i < frames_.all().size(); ++i) {
    if (i > 0) {
      std::vector<LandmarkObservation> observations;
      for (const TrackedFeature& f : frames_.all()[i].features) {
        const auto p = points.find(f.id);
        if (p != points.end()) observations.push_back({p->second, &f});
      }
      if (static_cast<int>(observations.size()) < kMinStructureInliers) return false;
      Pose<G, B> guess = poses.back();
      guess.q = guess.q * integrate_gyro(frames_.all()[i].imu, Vec3::Zero());
      const PoseRefinement refined = refine_pose(observations, calibration, guess);
      if (refined.inliers < std::max<double>(kMinStructureInliers, kMinInlierShare * static_cast<double>(observations.size())))
        return false;
      poses.push_back(refined.T_GB);
    }
    Frame f;
    f.id = frames_.all()[i].id;
    f.t = frames_.all()[i].t;
    f.state.T_FB = poses.back();
    structure_.add_frame(std::move(f), frames_.all()[i].features, calibration);
    if (i == 0) structure_.set_prior(held_still());
    // Stereo alone is inaccurate for far points: the motion so far improves them before the next pose needs them.
    if (i % kFramesPerRefinement == 0 || i + 1 == frames_.all().size()) {
      if (!refine_structure(calibration)) return false;
      for (const LocatedLandmark& l : located_landmarks(structure_, calibration)) points[l.track] = l.p_G;
    } else {
      for (const LocatedLandmark& l : located_landmarks(structure_, calibration)) points.try_emplace(l.track, l.p_G);
    }
    poses.back() = structure_.newest().state.T_FB;
  }
  if (!refine_structure(calibration)) return false;
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i] = structure_.frames()[i].state.T_FB;
  return true;
}

}  // namespace fbvins
