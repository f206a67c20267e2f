// SPDX-License-Identifier: Apache-2.0
// The orb frontend, part two: following the tracks there are from the image before into this one.
#include <algorithm>
#include <cmath>

#include "fbvins/frontend/orb_frontend.hpp"

namespace fbvins {
namespace {

/// A track expected this far outside the image is forgotten.
constexpr double kFarOutside_px = 40;
/// Descriptor distance of a match of descriptors as extracted, for comparison with improved ones.
constexpr int kRawDistance = 60;
/// A match this near to where its track turned out to be is right.
constexpr double kInlier_px = 3;

}  // namespace

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
    if (!rig_.left.inside(track.px, -kFarOutside_px)) {
      remember(track);
      track.alive = false;
    }
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
    // Searched for without its neighbours' help: a descriptor must say more.
    if (!track.was_in_sight) query.max_distance = std::min(query.max_distance, options_.out_of_sight_max_distance);
    queries_.push_back(query);
  }
  matcher_.match(queries_, left_features_, found_);
  remember_matches(found_, matched_);
}

/// What the same search finds by descriptors as they were extracted: for the statistics only.
void OrbFrontend::match_raw(FrontendStats& stats) {
  stats.matches.found = static_cast<int>(matched_.size());
  stats.raw_matches = stats.matches;
  matched_raw_.clear();
  if (!stage_->changes_descriptors()) return;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    queries_[i].descriptor = tracks_[i].raw;
    queries_[i].max_distance = std::min(queries_[i].max_distance, kRawDistance);
  }
  matcher_.match(queries_, raw_left_, found_raw_);
  remember_matches(found_raw_, matched_raw_);
  stats.raw_matches.found = static_cast<int>(matched_raw_.size());
}

void OrbFrontend::remember_matches(const std::vector<int>& found, std::vector<std::pair<TrackId, Vec2>>& matched) const {
  matched.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i)
    if (found[i] >= 0) matched.emplace_back(tracks_[i].id, left_features_.keypoints[static_cast<std::size_t>(found[i])].pixel);
}

/// Inliers lie near where their track is after alignment and outlier rejection.
void OrbFrontend::count_inliers(FrontendStats& stats) const {
  const auto inliers = [&](const std::vector<std::pair<TrackId, Vec2>>& matched) {
    int count = 0;
    auto next = matched.begin();  // both are in the same order; tracks without a match and matches of dropped tracks lie between
    for (const Track& track : tracks_) {
      const auto match = std::find_if(next, matched.end(), [&](const auto& m) { return m.first == track.id; });
      if (match == matched.end()) continue;
      next = match + 1;
      if (track.in_sight && (track.px - match->second).norm() < kInlier_px) ++count;
    }
    return count;
  };
  stats.matches.inliers = inliers(matched_);
  stats.raw_matches.inliers = stage_->changes_descriptors() ? inliers(matched_raw_) : stats.matches.inliers;
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
      if (stage_->changes_descriptors()) track.raw = raw_left_.descriptors[static_cast<std::size_t>(found_[i])];
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
  const KltResult newest = klt_align(patches.newest, left_, expected_px, kAlignmentLevels - 1, 0, options_.alignment);
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
  if (T_WC_) track.seen_from_W = T_WC_->p;
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
    if ((now - track.last_seen).seconds() > memory_s || track.age_frames < 2 || remembered == options_.max_remembered) {
      remember(track);
      track.alive = false;
    } else ++remembered;
  }
  drop_dead_tracks();
}

}  // namespace fbvins
