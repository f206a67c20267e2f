// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/klt_frontend.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/stage_timer.hpp"

namespace fbvins {
namespace {

/// An anchor seen smaller than this, or larger than its inverse, gives way to a new one.
constexpr double kSmallestScale = 0.65;
constexpr std::size_t kFewestForLongCheck = 12;
constexpr double kBorder_px = kKltReach - 2;

double median(std::vector<double>& numbers) {
  if (numbers.empty()) return 0;
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::nth_element(numbers.begin(), middle, numbers.end());
  return *middle;
}

}  // namespace

KltFrontend::KltFrontend(const StereoRig& rig, const KltFrontendOptions& options)
    : options_(options),
      rig_(rig),
      predictor_(rig.T_BC0),
      detector_(options.corners),
      stereo_(rig, options.stereo, options.klt),
      rng_(1) {
  templates_.resize(static_cast<std::size_t>(options.max_features));
  anchors_.resize(templates_.size());
  for (std::size_t i = templates_.size(); i-- > 0;) free_slots_.push_back(i);
}

TrackedFrame KltFrontend::process(const SensorPacket& packet, const StatePrior& prior) {
  TrackedFrame out;
  out.id = packet.id;
  out.t = packet.frame.t;
  out.imu = packet.imu;
  FrontendStats& stats = out.stats;
  CpuTimer timer;

  predictor_.add(packet.imu);
  ingest(packet, stats);
  out.has_left = !left_.empty();
  out.has_right = !right_.empty();
  stats.pyramid_ms = timer.lap_ms();
  // Without a left image features wait in the previous one for a while.
  if (left_.empty()) return out;

  if (!previous_left_.empty()) {
    const CameraMotion motion = predictor_.between(previous_t_, packet.frame.t, prior);
    follow_tracks(motion, stats);
    stats.track_ms = timer.lap_ms();
    reject_outliers(motion, stats);
    stats.geometry_ms = timer.lap_ms();
  }
  detect_corners(stats);
  stats.detect_ms = timer.lap_ms();
  match_stereo(stats);
  stats.stereo_ms = timer.lap_ms();
  report(out);
  std::swap(left_, previous_left_);
  previous_t_ = packet.frame.t;
  stats.geometry_ms += timer.lap_ms();
  return out;
}

void KltFrontend::ingest(const SensorPacket& packet, FrontendStats& stats) {
  left_.clear();
  right_.clear();
  if (packet.frame.left) left_.build(packet.frame.left->view(), options_.pyramid_levels);
  if (packet.frame.right) right_.build(packet.frame.right->view(), options_.pyramid_levels);
  stats.mean_brightness_left = mean_brightness(left_);
  stats.mean_brightness_right = mean_brightness(right_);
  // An image of another size than the calibration's has no known geometry.
  if (left_.width() != rig_.left.width() || left_.height() != rig_.left.height()) left_.clear();
  if (right_.width() != rig_.right.width() || right_.height() != rig_.right.height()) right_.clear();
  const bool too_long = (packet.frame.t - previous_t_).seconds() > options_.max_gap_s || packet.frame.t < previous_t_;
  if (!previous_left_.empty() && too_long) {
    drop_all_tracks();
    previous_left_.clear();
  }
}

Vec2 KltFrontend::predict(const Track& track, const CameraMotion& motion) const {
  if (!motion.has_rotation) return track.px;
  Vec3 ray = motion.R_ba * track.normalised.homogeneous();
  if (motion.has_translation) ray += track.inverse_depth.value_or(typical_inverse_depth_) * motion.p_ba;
  // Differences of the camera model rather than its value: exact for no motion.
  const auto then = rig_.left.project(track.normalised.homogeneous());
  const auto now = rig_.left.project(ray);
  if (!then || !now) return track.px;
  return track.px + *now - *then;
}

KltResult KltFrontend::align_to_anchor(const Track& track, const Vec2& start_px) {
  Mat2 J_pixel_normalised;
  rig_.left.distort(track.normalised, &J_pixel_normalised);
  // A small fronto-parallel plane at the anchor, seen from now.
  Eigen::Matrix<double, 2, 3> project;
  project << 1, 0, -track.normalised.x(), 0, 1, -track.normalised.y();
  const Mat2 J_now_anchor =
      J_pixel_normalised * project * track.R_now_anchor.leftCols<2>() / track.depth_ratio * track.J_normalised_pixel_anchor;
  const double scale2 = J_now_anchor.determinant();
  if (!(scale2 > kSmallestScale * kSmallestScale && scale2 * kSmallestScale * kSmallestScale < 1)) return {};
  if (!warped_.cut_warped(anchors_[track.slot], J_now_anchor.inverse())) return {};
  return klt_align(warped_, left_, start_px, 0, 0, options_.klt);
}

/// From here on the feature is what the present image shows.
void KltFrontend::set_anchor(Track& track) {
  anchors_[track.slot].take(left_, track.px);
  Mat2 J_pixel_normalised;
  rig_.left.distort(track.normalised, &J_pixel_normalised);
  track.J_normalised_pixel_anchor = J_pixel_normalised.inverse();
  track.R_now_anchor.setIdentity();
  track.depth_ratio = 1;
}

bool KltFrontend::follow(Track& track, const CameraMotion& motion, FrontendStats& stats) {
  KltTemplate& patch = templates_[track.slot];
  const Vec2 start = predict(track, motion);
  const int top = options_.pyramid_levels - 1;
  const bool well_predicted = motion.has_translation && track.inverse_depth;
  KltResult found = klt_align(patch, left_, start, well_predicted ? std::min(top, 2) : top, 0, options_.klt);
  if (!found.ok() && well_predicted) found = klt_align(patch, left_, start, top, 0, options_.klt);
  if (!found.ok()) {
    ++stats.lost_flow;
    return false;
  }
  Vec3 p_now = motion.R_ba * track.normalised.homogeneous() + track.inverse_depth.value_or(0) * motion.p_ba;
  const auto flow_normalised = rig_.left.undistort(found.px);
  if (!flow_normalised || !(p_now.z() > 0)) return false;
  track.previous_px = track.px;
  track.previous_normalised = track.normalised;
  track.normalised = *flow_normalised;
  track.R_now_anchor = motion.R_ba * track.R_now_anchor;
  track.depth_ratio *= p_now.z();
  if (track.inverse_depth) *track.inverse_depth /= p_now.z();

  const KltResult anchored = align_to_anchor(track, found.px);
  const bool anchor_holds = anchored.ok() && anchored.correlation > options_.min_anchor_correlation;
  if (anchor_holds && (anchored.px - found.px).norm() > options_.max_creep_px) {
    ++stats.lost_check;
    return false;
  }
  if (anchor_holds) found.px = anchored.px;
  if (!rig_.left.inside(found.px, kBorder_px) || !patch.cut(left_, found.px, 0, top)) {
    ++stats.lost_flow;
    return false;
  }
  const KltResult back = klt_align(patch, previous_left_, track.px, 1, 0, options_.klt);
  if (!back.ok() || (back.px - track.px).norm() > options_.forward_backward_px) {
    ++stats.lost_check;
    return false;
  }
  const auto normalised = rig_.left.undistort(found.px);
  if (!normalised) return false;
  track.px = found.px;
  track.normalised = *normalised;
  if (!anchor_holds) set_anchor(track);
  ++track.age_frames;
  return true;
}

void KltFrontend::follow_tracks(const CameraMotion& motion, FrontendStats& stats) {
  for (Track& track : tracks_) track.alive = follow(track, motion, stats);
  drop_dead_tracks();
  numbers_.clear();
  for (const Track& track : tracks_) numbers_.push_back((track.px - track.previous_px).norm());
  stats.median_motion_px = median(numbers_);
}

/// points_a_, points_b_ hold the matches of the tracks in indices_.
EpipolarResult KltFrontend::drop_off_epipolar(const std::optional<Mat3>& R_ba, double threshold_px, FrontendStats& stats) {
  EpipolarOptions ransac;
  ransac.threshold = threshold_px / rig_.left.focal_px();
  EpipolarResult result = ransac_epipolar(points_a_, points_b_, R_ba, ransac, rng_);
  for (std::size_t i = 0; i < indices_.size(); ++i) {
    if (result.inlier[i]) continue;
    tracks_[indices_[i]].alive = false;
    ++stats.lost_epipolar;
  }
  drop_dead_tracks();
  return result;
}

void KltFrontend::reject_outliers(const CameraMotion& motion, FrontendStats& stats) {
  points_a_.clear();
  points_b_.clear();
  indices_.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    points_a_.push_back(tracks_[i].previous_normalised);
    points_b_.push_back(tracks_[i].normalised);
    indices_.push_back(i);
  }
  std::optional<Mat3> R_ba;
  if (motion.has_rotation) R_ba = motion.R_ba;
  const EpipolarResult result = drop_off_epipolar(R_ba, options_.epipolar_px, stats);
  reject_slow_outliers(result.R_ba, stats);
  for (Track& track : tracks_) track.history[static_cast<std::size_t>(track.age_frames % kHistory)] = track.normalised;
  stats.tracked = static_cast<int>(tracks_.size());
}

/// What slides along an occluding edge, or moves slowly, obeys the constraint from one frame to the
/// next and breaks it over several.
void KltFrontend::reject_slow_outliers(const Mat3& R_ba, FrontendStats& stats) {
  rotations_[static_cast<std::size_t>(next_rotation_)] = R_ba;
  next_rotation_ = (next_rotation_ + 1) % kHistory;
  points_a_.clear();
  points_b_.clear();
  indices_.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const Track& track = tracks_[i];
    if (track.age_frames < kHistory) continue;
    points_a_.push_back(track.history[static_cast<std::size_t>(track.age_frames % kHistory)]);
    points_b_.push_back(track.normalised);
    indices_.push_back(i);
  }
  if (indices_.size() < kFewestForLongCheck) return;
  Mat3 R_now_then = Mat3::Identity();
  for (int i = 0; i < kHistory; ++i)
    R_now_then = rotations_[static_cast<std::size_t>((next_rotation_ + i) % kHistory)] * R_now_then;
  drop_off_epipolar(R_now_then, options_.long_epipolar_px, stats);
}

void KltFrontend::detect_corners(FrontendStats& stats) {
  points_a_.clear();
  for (const Track& track : tracks_) points_a_.push_back(track.px);
  const int wanted = options_.max_features - static_cast<int>(tracks_.size());
  for (const Corner& corner : detector_.detect(left_, points_a_, wanted)) {
    const auto normalised = rig_.left.undistort(corner.px);
    if (!normalised) continue;
    Track track;
    track.slot = take_slot();
    if (!templates_[track.slot].cut(left_, corner.px, 0, options_.pyramid_levels - 1)) {
      free_slots_.push_back(track.slot);
      continue;
    }
    track.id = TrackId{next_track_++};
    track.px = corner.px;
    track.normalised = *normalised;
    set_anchor(track);
    track.history[0] = track.normalised;
    tracks_.push_back(track);
    ++stats.detected;
  }
}

void KltFrontend::match_stereo(FrontendStats& stats) {
  numbers_.clear();
  for (Track& track : tracks_) {
    track.right.reset();
    if (right_.empty()) continue;
    const StereoMatch match =
        stereo_.match(templates_[track.slot], track.px, track.normalised, track.inverse_depth, left_, right_);
    if (match.failure != StereoFailure::none) continue;
    track.right = match;
    track.inverse_depth = match.inverse_depth;
    numbers_.push_back(match.inverse_depth);
    ++stats.stereo;
  }
  if (numbers_.size() >= 10) typical_inverse_depth_ = median(numbers_);
}

void KltFrontend::drop_dead_tracks() {
  for (const Track& track : tracks_)
    if (!track.alive) free_slots_.push_back(track.slot);
  std::erase_if(tracks_, [](const Track& track) { return !track.alive; });
}

void KltFrontend::drop_all_tracks() {
  for (Track& track : tracks_) track.alive = false;
  drop_dead_tracks();
}

std::size_t KltFrontend::take_slot() {
  const std::size_t slot = free_slots_.back();
  free_slots_.pop_back();
  return slot;
}

Observation KltFrontend::observe(const Camera& camera, const Vec2& px, const Vec2& normalised) const {
  Observation observation;
  observation.pixel = px;
  observation.normalised = normalised;
  Mat2 J_pixel_normalised;
  camera.distort(normalised, &J_pixel_normalised);
  observation.sqrt_information = J_pixel_normalised / options_.sigma_px;
  return observation;
}

void KltFrontend::report(TrackedFrame& out) {
  out.features.reserve(tracks_.size());
  for (const Track& track : tracks_) {
    TrackedFeature feature;
    feature.id = track.id;
    feature.left = observe(rig_.left, track.px, track.normalised);
    if (track.right) feature.right = observe(rig_.right, track.right->px, track.right->normalised);
    feature.age_frames = track.age_frames;
    out.features.push_back(feature);
  }
}

}  // namespace fbvins
