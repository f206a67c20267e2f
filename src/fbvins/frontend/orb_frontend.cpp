// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_frontend.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/stage_timer.hpp"

namespace fbvins {
namespace {

constexpr int kPyramidLevels = 3;
constexpr double kBorder_px = kKltReach - 2;
/// A track expected this far outside the image is forgotten.
constexpr double kFarOutside_px = 40;
/// Descriptor distance asked of a track that was out of sight: it is searched for without its neighbours' help.
constexpr int kStricterDistance = 45;

/// Standard deviation of the position along its weakest direction for image noise of one grey value, px.
double weakest_direction_px(const KltLevelTemplate& patch) {
  const double mean = 0.5 * (patch.ihxx + patch.ihyy), half = 0.5 * (patch.ihxx - patch.ihyy);
  return std::sqrt(mean + std::sqrt(half * half + static_cast<double>(patch.ihxy) * patch.ihxy));
}

double median(std::vector<double>& numbers) {
  if (numbers.empty()) return 0;
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::nth_element(numbers.begin(), middle, numbers.end());
  return *middle;
}

}  // namespace

OrbFrontend::OrbFrontend(const StereoRig& rig, const OrbFrontendOptions& options, std::unique_ptr<DescriptorStage> stage)
    : options_(options), rig_(rig), stage_(std::move(stage)), predictor_(rig.T_BC0), extractor_(options.orb),
      matcher_(options.matching), stereo_(rig, options.stereo),
      stereo_fill_in_(rig, options.stereo_fill_in, options.alignment), refiner_(options.refine, options.alignment), rng_(2) {
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
  stats.pyramid_ms = timer.lap_ms();
  // Without a left image tracks wait where they were; the next image's motion spans the gap.
  if (!has_left) return out;

  extract_left(packet.frame.left->view());
  stats.detect_ms = timer.lap_ms();
  history_t_[static_cast<std::size_t>(frame_count_) % kHistory] = now_;
  if (has_previous_) {
    const CameraMotion motion = predictor_.between(previous_t_, now_, prior);
    predict(motion);
    match_tracks(motion);
    locate_tracks(stats);
    stats.track_ms = timer.lap_ms();
    reject_outliers(prior, stats);
    thin_out();
    forget(now_);
    stats.geometry_ms = timer.lap_ms();
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
  if (packet.frame.left) left_.build(packet.frame.left->view(), kPyramidLevels);
  if (packet.frame.right) right_.build(packet.frame.right->view(), kPyramidLevels);
  stats.mean_brightness_left = mean_brightness(left_);
  stats.mean_brightness_right = mean_brightness(right_);
  // An image of another size than the calibration's has no known geometry.
  if (left_.width() != rig_.left.width() || left_.height() != rig_.left.height()) left_.clear();
  if (right_.width() != rig_.right.width() || right_.height() != rig_.right.height()) right_.clear();
  right_view_ = right_.empty() ? ImageView{} : packet.frame.right->view();
  // Backwards, or longer than any track is remembered: nothing carries over.
  if (has_previous_ && (now_ < previous_t_ || (now_ - previous_t_).seconds() > std::max(options_.memory_s, 0.3))) {
    for (Track& track : tracks_) track.alive = false;
    drop_dead_tracks();
    has_previous_ = false;
  }
  return !left_.empty();
}

void OrbFrontend::extract_left(const ImageView& image) {
  extractor_.extract(image, left_features_);
  stage_->improve(left_.width(), left_.height(), left_features_);
  matcher_.index(left_.width(), left_.height(), left_features_.keypoints);
  keypoint_used_.assign(left_features_.size(), 0);
}

/// Moves every track to where it should be now.
void OrbFrontend::predict(const CameraMotion& motion) {
  for (Track& track : tracks_) {
    track.was_in_sight = track.in_sight;
    track.in_sight = false;
    track.right.reset();
    track.previous_normalised = track.normalised;
    track.previous_px = track.px;
    track.depth_factor = 1;
    if (!motion.has_rotation) continue;
    const double rho = track.inverse_depth.value_or(typical_inverse_depth_);
    Vec3 ray = motion.R_ba * track.normalised.homogeneous();
    if (motion.has_translation) ray += rho * motion.p_ba;
    const auto then = rig_.left.project(track.normalised.homogeneous());
    const auto now = rig_.left.project(ray);
    if (!then || !now || !(ray.z() > 0.1)) {
      track.alive = false;
      continue;
    }
    track.px += *now - *then;  // a difference: exact for no motion
    track.normalised = ray.hnormalized();
    track.depth_factor = ray.z();
    if (track.inverse_depth) *track.inverse_depth /= ray.z();
    patches_[track.slot].reference.carry(motion.R_ba, ray.z());
    if (!rig_.left.inside(track.px, -kFarOutside_px)) track.alive = false;
  }
  drop_dead_tracks();
}

void OrbFrontend::match_tracks(const CameraMotion& motion) {
  queries_.clear();
  for (const Track& track : tracks_) {
    GuidedQuery query;
    query.px = track.px;
    query.level = track.level;
    query.descriptor = track.descriptor;
    query.radius_px = motion.has_translation ? options_.search_px : options_.search_blind_px;
    query.max_distance = options_.matching.max_distance;
    if (!track.was_in_sight) query.max_distance = std::min(query.max_distance, kStricterDistance);
    queries_.push_back(query);
  }
  matcher_.match(queries_, left_features_, found_);
}

void OrbFrontend::locate_tracks(FrontendStats& stats) {
  // What the prediction missed in common (gyro bias, unknown translation) helps those without a match.
  numbers_.clear();
  numbers_y_.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (found_[i] < 0 || !tracks_[i].was_in_sight) continue;
    const Vec2 miss = left_features_.keypoints[static_cast<std::size_t>(found_[i])].pixel - tracks_[i].px;
    numbers_.push_back(miss.x());
    numbers_y_.push_back(miss.y());
  }
  Vec2 common_miss = Vec2::Zero();
  if (numbers_.size() >= 8) common_miss = Vec2(median(numbers_), median(numbers_y_));

  numbers_.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    const Vec2 before = track.px;
    const Keypoint* keypoint = found_[i] < 0 ? nullptr : &left_features_.keypoints[static_cast<std::size_t>(found_[i])];
    const Vec2 expected = track.px + common_miss;
    std::optional<Vec2> px;
    if (keypoint != nullptr) {
      px = options_.subpixel ? refine_match(track, keypoint->pixel, keypoint->scale) : std::optional<Vec2>(keypoint->pixel);
      if (!px) ++stats.lost_check;
    } else if (track.was_in_sight && options_.fill_in) {
      px = follow_by_alignment(track, expected);
    }
    if (px && track.was_in_sight && options_.subpixel && !returns(track, *px)) {
      px.reset();
      ++stats.lost_check;
    }
    if (!px || !settle(track, *px)) {
      if (track.was_in_sight && keypoint == nullptr) ++stats.lost_flow;
      continue;
    }
    if (keypoint != nullptr) {
      track.descriptor = left_features_.descriptors[static_cast<std::size_t>(found_[i])];
      track.level = keypoint->level;
      keypoint_used_[static_cast<std::size_t>(found_[i])] = 1;
    }
    if (track.was_in_sight) numbers_.push_back((track.px - before).norm());
  }
  stats.median_motion_px = median(numbers_);
}

/// From a keypoint to the place that shows the track's reference patch.
std::optional<Vec2> OrbFrontend::refine_match(Track& track, const Vec2& start_px, double scale) {
  const Patches& patches = patches_[track.slot];
  if (!track.was_in_sight) {
    const KltResult fine = refiner_.refine(patches.reference, left_, start_px, rig_.left, track.normalised);
    return refiner_.accept(fine, start_px, scale) ? std::optional<Vec2>(fine.px) : std::nullopt;
  }
  const KltResult newest = klt_align(patches.newest, left_, start_px, 1, 0, options_.alignment);
  if (!refiner_.accept(newest, start_px, scale)) return std::nullopt;
  return hold_to_reference(track, newest.px);
}

std::optional<Vec2> OrbFrontend::follow_by_alignment(Track& track, const Vec2& expected_px) {
  const Patches& patches = patches_[track.slot];
  const KltResult newest = klt_align(patches.newest, left_, expected_px, kPyramidLevels - 1, 0, options_.alignment);
  if (!newest.ok() || newest.correlation < options_.fill_in_correlation) return std::nullopt;
  if ((newest.px - expected_px).norm() > options_.search_blind_px) return std::nullopt;
  return hold_to_reference(track, newest.px);
}

/// The position against the reference, where the reference still looks alike. The newest patch and the reference
/// disagreeing means that one of them slid along an edge or onto something else.
std::optional<Vec2> OrbFrontend::hold_to_reference(Track& track, const Vec2& newest_px) {
  const KltResult fine = refiner_.refine(patches_[track.slot].reference, left_, newest_px, rig_.left, track.normalised);
  track.renew_reference = !refiner_.accept(fine, newest_px, 1.0);
  if (track.renew_reference) return newest_px;
  if ((fine.px - newest_px).norm() > options_.max_creep_px) return std::nullopt;
  return fine.px;
}

/// Following the patch found now back into the image before leads to where the track was.
bool OrbFrontend::returns(const Track& track, const Vec2& px) {
  if (!scratch_.cut(left_, px, 0, 1)) return false;
  const KltResult back = klt_align(scratch_, previous_left_, track.previous_px, 1, 0, options_.alignment);
  return back.ok() && (back.px - track.previous_px).norm() <= options_.forward_backward_px;
}

/// The track is at px in the newest image. False at the border.
bool OrbFrontend::settle(Track& track, const Vec2& px) {
  if (!rig_.left.inside(px, kBorder_px)) return false;
  const auto normalised = rig_.left.undistort(px);
  if (!normalised) return false;
  track.px = px;
  track.normalised = *normalised;
  track.in_sight = true;
  track.last_seen = now_;
  ++track.age_frames;
  return true;
}

/// Against the image before, and against one some frames back: where two edges cross at different depths, a corner
/// slides by less than the noise from frame to frame, but not for long.
void OrbFrontend::reject_outliers(const StatePrior& prior, FrontendStats& stats) {
  const std::size_t newest = static_cast<std::size_t>(frame_count_) % kHistory;
  for (Track& track : tracks_) track.history[newest] = {track.normalised, track.in_sight ? frame_count_ : -1};
  for (const int lag : {1, static_cast<int>(kHistory) - 1}) {
    const std::int64_t then = frame_count_ - lag;
    if (then < 0) continue;
    const std::size_t place = static_cast<std::size_t>(then) % kHistory;
    const CameraMotion motion = predictor_.between(history_t_[place], now_, prior);
    check_epipolar(motion, then, stats);
  }
}

void OrbFrontend::check_epipolar(const CameraMotion& motion, std::int64_t then, FrontendStats& stats) {
  points_a_.clear();
  points_b_.clear();
  order_.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const Sighting& sighting = tracks_[i].history[static_cast<std::size_t>(then) % kHistory];
    if (!tracks_[i].in_sight || sighting.frame != then) continue;
    order_.push_back(i);
    points_a_.push_back(sighting.normalised);
    points_b_.push_back(tracks_[i].normalised);
  }
  EpipolarOptions ransac;
  ransac.threshold = options_.epipolar_px / rig_.left.focal_px();
  std::optional<Mat3> R_ba;
  if (motion.has_rotation) R_ba = motion.R_ba;
  const EpipolarResult result = ransac_epipolar(points_a_, points_b_, R_ba, ransac, rng_);
  for (std::size_t k = 0; k < order_.size(); ++k) {
    if (result.inlier[k] != 0) continue;
    tracks_[order_[k]].alive = false;
    ++stats.lost_epipolar;
  }
  drop_dead_tracks();
}

/// Two tracks that have come together are one: the older stays. Then no more than wanted, the older first.
void OrbFrontend::thin_out() {
  std::stable_sort(tracks_.begin(), tracks_.end(), [](const Track& a, const Track& b) { return a.age_frames > b.age_frames; });
  const double closest2 = 0.16 * options_.min_distance_px * options_.min_distance_px;
  int kept = 0;
  points_a_.clear();
  for (Track& track : tracks_) {
    if (!track.in_sight) continue;
    const bool crowded = std::any_of(points_a_.begin(), points_a_.end(),
                                     [&](const Vec2& other) { return (other - track.px).squaredNorm() < closest2; });
    if (crowded || kept == options_.max_features) {
      track.alive = false;
      continue;
    }
    points_a_.push_back(track.px);
    ++kept;
  }
  drop_dead_tracks();
}

/// Tracks out of sight for too long, and the oldest of too many.
void OrbFrontend::forget(Time now) {
  int remembered = 0;
  for (Track& track : tracks_) {
    if (track.in_sight) continue;
    // Without depth the prediction is a guess that soon is worth nothing.
    const double memory_s = track.inverse_depth ? options_.memory_s : 0.3 * options_.memory_s;
    if ((now - track.last_seen).seconds() > memory_s || track.age_frames < 2 || remembered == options_.max_remembered)
      track.alive = false;
    else
      ++remembered;
  }
  drop_dead_tracks();
}

void OrbFrontend::cut_patches() {
  for (Track& track : tracks_) {
    if (!track.in_sight) continue;
    Patches& patches = patches_[track.slot];
    track.alive = patches.newest.cut(left_, track.px, 0, kPyramidLevels - 1);
    if (track.alive && track.renew_reference) patches.reference.take(left_, track.px, rig_.left, track.normalised);
    track.renew_reference = false;
  }
  drop_dead_tracks();
}

/// New tracks where there are few: first for image cells with less than their share, then anywhere.
void OrbFrontend::start_tracks(FrontendStats& stats) {
  points_a_.clear();
  for (const Track& track : tracks_)
    if (track.in_sight) points_a_.push_back(track.px);
  stats.tracked = static_cast<int>(points_a_.size());

  constexpr int kColumns = 8, kRows = 5;
  const auto cell = [&](const Vec2& px) {
    const int x = std::clamp(static_cast<int>(px.x() * kColumns / left_.width()), 0, kColumns - 1);
    const int y = std::clamp(static_cast<int>(px.y() * kRows / left_.height()), 0, kRows - 1);
    return static_cast<std::size_t>(y * kColumns + x);
  };
  std::array<int, kColumns * kRows> count{};
  for (const Vec2& px : points_a_) ++count[cell(px)];
  const int share = options_.max_features / (kColumns * kRows) + 1;

  order_.clear();
  for (std::size_t k = 0; k < left_features_.size(); ++k)
    if (keypoint_used_[k] == 0) order_.push_back(k);
  const auto& keypoints = left_features_.keypoints;
  std::stable_sort(order_.begin(), order_.end(),
                   [&](std::size_t a, std::size_t b) { return keypoints[a].score > keypoints[b].score; });
  const double min2 = options_.min_distance_px * options_.min_distance_px;
  for (const bool only_poor_cells : {true, false}) {
    for (const std::size_t k : order_) {
      if (static_cast<int>(points_a_.size()) >= options_.max_features) return;
      const Keypoint& keypoint = keypoints[k];
      if (keypoint_used_[k] != 0 || (only_poor_cells && count[cell(keypoint.pixel)] >= share)) continue;
      const bool crowded = std::any_of(points_a_.begin(), points_a_.end(), [&](const Vec2& other) {
        return (other - keypoint.pixel).squaredNorm() < min2;
      });
      if (crowded || !start_track(keypoint, left_features_.descriptors[k])) continue;
      keypoint_used_[k] = 1;
      points_a_.push_back(keypoint.pixel);
      ++count[cell(keypoint.pixel)];
      ++stats.detected;
    }
  }
}

bool OrbFrontend::start_track(const Keypoint& keypoint, const Descriptor& descriptor) {
  const auto normalised = rig_.left.undistort(keypoint.pixel);
  if (!normalised || free_slots_.empty() || !rig_.left.inside(keypoint.pixel, kBorder_px)) return false;
  Track track;
  track.slot = free_slots_.back();
  Patches& patches = patches_[track.slot];
  if (!patches.newest.cut(left_, keypoint.pixel, 0, kPyramidLevels - 1)) return false;
  if (weakest_direction_px(patches.newest.levels[0]) > options_.max_uncertainty_px) return false;
  if (!patches.reference.take(left_, keypoint.pixel, rig_.left, *normalised)) return false;
  free_slots_.pop_back();
  track.id = TrackId{next_track_++};
  track.descriptor = descriptor;
  track.level = keypoint.level;
  track.px = keypoint.pixel;
  track.normalised = *normalised;
  track.last_seen = now_;
  track.in_sight = true;
  track.history[static_cast<std::size_t>(frame_count_) % kHistory] = {track.normalised, frame_count_};
  tracks_.push_back(track);
  return true;
}

void OrbFrontend::match_stereo(FrontendStats& stats) {
  if (right_.empty()) return;
  extractor_.extract(right_view_, right_features_);
  stage_->improve(right_.width(), right_.height(), right_features_);
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
  observation.sqrt_information = J_pixel_normalised / options_.sigma_px;
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

}  // namespace fbvins
