// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_frontend.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/stage_timer.hpp"

namespace fbvins {
namespace {

/// Without images for longer, the predictor's IMU readings no longer span the gap.
constexpr double kLongestGap_s = 1.4;

}  // namespace

OrbFrontend::OrbFrontend(const StereoRig& rig, const OrbFrontendOptions& options, std::unique_ptr<DescriptorStage> stage)
    : options_(options),
      rig_(rig),
      stage_(std::move(stage)),
      predictor_(rig.T_BC0),
      extractor_(options.orb, stage_->changes_descriptors()),
      matcher_(options.matching),
      stereo_(rig, options.stereo),
      stereo_fill_in_(rig, options.stereo_fill_in, options.alignment),
      refiner_(options.refine, options.alignment),
      rng_(2),
      memory_(options.recognition) {
  patches_.resize(static_cast<std::size_t>(options.max_features + options.max_remembered));
  for (std::size_t i = patches_.size(); i-- > 0;) free_slots_.push_back(i);
}

TrackedFrame OrbFrontend::process(const SensorPacket& packet, const StatePrior& prior) {
  TrackedFrame out;
  out.id = packet.id;
  out.t = packet.frame.t;
  out.imu = packet.imu;
  FrontendStats& stats = out.stats;
  CpuTimer timer;

  predictor_.add(packet.imu);
  const bool has_left = ingest(packet, stats);
  out.has_left = has_left;
  out.has_right = !right_.empty();
  stats.pyramid_ms = timer.lap_ms();
  memory_.forget_unlocated(now_);
  // Without a left image tracks wait where they were; the next image's motion spans the gap.
  if (!has_left) return out;
  T_WC_ = predictor_.camera_at(now_, prior);

  extract_left(packet.frame.left->view(), stats);
  stats.detect_ms = timer.lap_ms();
  history_t_[static_cast<std::size_t>(frame_count_) % kHistory] = now_;
  if (has_previous_) {
    const CameraMotion motion = predictor_.between(previous_t_, now_, prior);
    predict(motion);
    match_tracks(motion);
    match_raw(stats);
    locate_tracks(stats);
    recognise(stats);
    stats.track_ms = timer.lap_ms();
    reject_outliers(prior, stats);
    count_inliers(stats);
    thin_out();
    forget(now_);
    stats.geometry_ms = timer.lap_ms();
  } else {
    recognise(stats);
  }
  cut_patches();
  start_tracks(stats);
  stats.track_ms += timer.lap_ms();
  match_stereo(stats);
  report(out);
  stats.stereo_ms = timer.lap_ms();
  std::swap(left_, previous_left_);
  has_previous_ = true;
  previous_t_ = now_;
  ++frame_count_;
  return out;
}

/// False without a usable left image.
bool OrbFrontend::ingest(const SensorPacket& packet, FrontendStats& stats) {
  now_ = packet.frame.t;
  left_.clear();
  right_.clear();
  if (packet.frame.left) left_.build(packet.frame.left->view(), kAlignmentLevels);
  if (packet.frame.right) right_.build(packet.frame.right->view(), kAlignmentLevels);
  stats.mean_brightness_left = mean_brightness(left_);
  stats.mean_brightness_right = mean_brightness(right_);
  // An image of another size than the calibration's has no known geometry.
  if (left_.width() != rig_.left.width() || left_.height() != rig_.left.height()) left_.clear();
  if (right_.width() != rig_.right.width() || right_.height() != rig_.right.height()) right_.clear();
  right_view_ = right_.empty() ? ImageView{} : packet.frame.right->view();
  // Backwards, or longer than any track is remembered: nothing carries over.
  if (has_previous_ &&
      (now_ < previous_t_ || (now_ - previous_t_).seconds() > std::clamp(options_.memory_s, 0.3, kLongestGap_s))) {
    for (Track& track : tracks_) {
      remember(track);
      track.alive = false;
    }
    drop_dead_tracks();
    has_previous_ = false;
  }
  return !left_.empty();
}

void OrbFrontend::extract_left(const ImageView& image, FrontendStats& stats) {
  extractor_.extract(image, left_features_);
  if (stage_->changes_descriptors()) {
    raw_left_.keypoints = left_features_.keypoints;
    raw_left_.descriptors = left_features_.descriptors;
  }
  CpuTimer timer;
  stage_->improve(left_.width(), left_.height(), left_features_);
  stats.boost_ms = timer.lap_ms();
  matcher_.index(left_.width(), left_.height(), left_features_.keypoints);
  keypoint_used_.assign(left_features_.size(), 0);
}

void OrbFrontend::cut_patches() {
  for (Track& track : tracks_) {
    if (!track.in_sight) continue;
    Patches& patches = patches_[track.slot];
    track.alive = patches.newest.cut(left_, track.px, 0, kAlignmentLevels - 1);
    if (track.alive && track.renew_reference) patches.reference.take(left_, track.px, rig_.left, track.normalised);
    track.renew_reference = false;
  }
  drop_dead_tracks();
}

void OrbFrontend::match_stereo(FrontendStats& stats) {
  if (right_.empty()) return;
  extractor_.extract(right_view_, right_features_);
  CpuTimer timer;
  stage_->improve(right_.width(), right_.height(), right_features_);
  stats.boost_ms += timer.lap_ms();
  stereo_.index(right_features_);
  numbers_.clear();
  for (Track& track : tracks_) {
    if (!track.in_sight) continue;
    const auto px = find_in_right(track);
    if (!px) continue;
    const auto normalised = rig_.right.undistort(*px);
    if (!normalised) continue;
    const auto rho = stereo_.inverse_depth(track.normalised, *normalised);
    if (!rho) continue;
    track.right = observe(rig_.right, *px, *normalised);
    track.inverse_depth = *rho;
    numbers_.push_back(*rho);
    ++stats.stereo;
  }
  if (numbers_.size() >= 10) typical_inverse_depth_ = median(numbers_);
}

std::optional<Vec2> OrbFrontend::find_in_right(const Track& track) {
  const KltTemplate& patch = patches_[track.slot].newest;
  const int k = stereo_.candidate(track.normalised, track.level, track.descriptor);
  if (k >= 0) {
    const Keypoint& keypoint = right_features_.keypoints[static_cast<std::size_t>(k)];
    if (!options_.subpixel) return keypoint.pixel;
    const KltResult fine = klt_align(patch, right_, keypoint.pixel, 1, 0, options_.alignment);
    if (refiner_.accept(fine, keypoint.pixel, keypoint.scale) && rig_.right.inside(fine.px, 2)) return fine.px;
  }
  if (!options_.fill_in) return std::nullopt;
  const StereoMatch match = stereo_fill_in_.match(patch, track.px, track.normalised, track.inverse_depth, left_, right_);
  if (match.failure != StereoFailure::none) return std::nullopt;
  return match.px;
}

void OrbFrontend::drop_dead_tracks() {
  for (const Track& track : tracks_)
    if (!track.alive) free_slots_.push_back(track.slot);
  std::erase_if(tracks_, [](const Track& track) { return !track.alive; });
}

Observation OrbFrontend::observe(const Camera& camera, const Vec2& px, const Vec2& normalised) const {
  Observation observation;
  observation.pixel = px;
  observation.normalised = normalised;
  Mat2 J_pixel_normalised;
  camera.distort(normalised, &J_pixel_normalised);
  observation.sqrt_information = J_pixel_normalised / (options_.subpixel ? options_.sigma_px : options_.sigma_unrefined_px);
  return observation;
}

void OrbFrontend::report(TrackedFrame& out) const {
  for (const Track& track : tracks_) {
    if (!track.in_sight) continue;
    TrackedFeature feature;
    feature.id = track.id;
    feature.left = observe(rig_.left, track.px, track.normalised);
    feature.right = track.right;
    feature.age_frames = track.age_frames;
    out.features.push_back(feature);
  }
}

double OrbFrontend::median(std::vector<double>& numbers) {
  if (numbers.empty()) return 0;
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::nth_element(numbers.begin(), middle, numbers.end());
  return *middle;
}

}  // namespace fbvins
