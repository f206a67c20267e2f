// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/klt_frontend.hpp"

#include <algorithm>

#include "fbvins/core/stage_timer.hpp"
#include "fbvins/frontend/observe.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kSeed = 1;
/// RANSAC threshold between left images KltTrack::kHistory frames apart, and the fewest tracks of that age for this check.
constexpr double kLongEpipolar_px = 1.0;
constexpr std::size_t kFewestForLongCheck = 12;
/// With a second camera; one camera alone restarts more often with so few (docs/experiments/speed.md).
constexpr int kCellsPerCorner = 2;
/// Depths change little from image to image, and a patch that is followed looks the same in both.
constexpr KltStereoEffort kStereo{.known_depth_level = 0, .sure_correlation = 0.9};

}  // namespace

KltFrontend::KltFrontend(const StereoRig& rig, const KltFrontendOptions& options)
    : options_(options),
      most_(options.max_features),
      rig_(rig),
      images_(rig, kKltLevels),
      predictor_(rig.T_BC0()),
      tracks_(options.max_features),
      follower_(rig.left(), rig.has_right() ? kFollowedByPair : KltFollowEffort{}),
      motion_(rig.left(), baseline_for_depths_m(rig)),
      epipolar_(rig.left().focal_px(), kSeed),
      detector_(options.min_distance_px, rig.has_right() ? kCellsPerCorner : ShiTomasiDetector::kFewestCells),
      stereo_(rig, options.min_depth_m, kStereo) {}

TrackedFrame KltFrontend::process(const SensorPacket& packet, const StatePrior& prior) {
  TrackedFrame out;
  out.id = packet.id;
  out.t = packet.frame.t;
  out.imu = packet.imu;
  FrontendStats& stats = out.stats;
  CpuTimer timer;

  predictor_.add(packet.imu, prior);
  images_.take(packet.frame, stats);
  if (images_.forget_before_gap(options_.max_gap_s)) {
    tracks_.end_all(TrackStatus::lost);
    tracks_.drop_ended();
  }
  out.cameras = {!images_.left().empty(), images_.has_depth()};
  stats.pyramid_ms = timer.lap_ms();
  // Without a left image tracks stay as they are; the motion to the next image spans the gap.
  if (!out.has(0)) return out;

  if (images_.has_before()) {
    const CameraMotion motion = predictor_.between(images_.t_before(), images_.t());
    follow_tracks(motion, stats);
    stats.track_ms = timer.lap_ms();
    reject_outliers(motion, stats);
    stats.geometry_ms = timer.lap_ms();
  }
  detect_corners(stats);
  stats.detect_ms = timer.lap_ms();
  match_stereo(stats);
  stats.stereo_ms = timer.lap_ms();
  out.features = features_of(tracks_, rig_.left(), options_.sigma_px);
  images_.advance();
  stats.geometry_ms += timer.lap_ms();
  return out;
}

void KltFrontend::locate(const LandmarkUpdate& update) {
  if (updates_.take(update) == LandmarkUpdates::Kind::earlier_void) predictor_.forget_state();
}

void KltFrontend::follow_tracks(const CameraMotion& motion, FrontendStats& stats) {
  for (KltTrack& track : tracks_)
    if (!follower_.follow(track, tracks_.patches(track), motion, typical_depth_.inverse_depth(), images_, stats))
      track.status = TrackStatus::lost;
  tracks_.drop_ended();
  std::vector<double> motion_px;
  motion_px.reserve(tracks_.size());
  for (const KltTrack& track : tracks_) motion_px.push_back((track.px - track.previous_px).norm());
  stats.median_motion_px = median(motion_px);
}

void KltFrontend::reject_outliers(const CameraMotion& motion, FrontendStats& stats) {
  std::optional<Mat3> R_ba;
  if (motion.has_rotation) R_ba = motion.R_ba;
  motion_.collect(tracks_, [](const KltTrack& track) { return &track.previous_normalised; });
  motion_.judge(tracks_, motion, (images_.t() - images_.t_before()).seconds(), stats);
  epipolar_.collect(tracks_, [](const KltTrack& track) { return &track.previous_normalised; });
  const EpipolarResult result = epipolar_.judge(tracks_, R_ba, options_.epipolar_px, stats);
  reject_slow_outliers(result.R_ba, stats);
  tracks_.drop_ended();
  for (KltTrack& track : tracks_) track.at_age(track.age_frames) = track.normalised;
  stats.tracked = static_cast<int>(tracks_.size());
}

/// A track that slides along an occluding edge, or moves slowly, satisfies the constraint from one frame to the
/// next, but not over several.
void KltFrontend::reject_slow_outliers(const Mat3& R_ba, FrontendStats& stats) {
  constexpr int kHistory = KltTrack::kHistory;
  rotations_[static_cast<std::size_t>(next_rotation_)] = R_ba;
  next_rotation_ = (next_rotation_ + 1) % kHistory;
  epipolar_.collect(tracks_, [](const KltTrack& track) -> const Vec2* {
    return track.age_frames < kHistory ? nullptr : &track.at_age(track.age_frames);  // not overwritten yet: kHistory ago
  });
  if (epipolar_.gathered() < kFewestForLongCheck) return;
  Mat3 R_now_then = Mat3::Identity();
  for (int i = 0; i < kHistory; ++i)
    R_now_then = rotations_[static_cast<std::size_t>((next_rotation_ + i) % kHistory)] * R_now_then;
  (void)epipolar_.judge(tracks_, R_now_then, kLongEpipolar_px, stats);
}

void KltFrontend::detect_corners(FrontendStats& stats) {
  std::vector<Vec2> occupied;
  occupied.reserve(tracks_.size());
  for (const KltTrack& track : tracks_) occupied.push_back(track.px);
  const int wanted = std::min(most_, options_.max_features) - static_cast<int>(tracks_.size());
  for (const Corner& corner : detector_.detect(images_.left(), occupied, wanted, rig_.left().mask().get()))
    if (start_track(corner.px)) ++stats.detected;
}

bool KltFrontend::start_track(const Vec2& px) {
  const auto normalised = rig_.left().undistort(px);
  if (!normalised) return false;
  KltTrack track;
  track.px = px;
  track.normalised = *normalised;
  if (!cut_patches(track, tracks_.free_patches(), images_.left())) return false;
  tracks_.start(track);
  return true;
}

bool KltFrontend::cut_patches(KltTrack& track, KltPatches& patches, const Pyramid& image) const {
  if (!patches.newest.cut(image, track.px, 0, 0)) return false;
  follower_.set_reference(track, patches, image);
  track.at_age(0) = track.normalised;
  return true;
}

TrackTransfer KltFrontend::hand_over() {
  TrackTransfer out{images_.t_right(), images_.take_right(), {}, tracks_.next_id()};
  if (out.image.empty()) return out;
  for (const KltTrack& track : tracks_)
    if (const auto handed = seen_by_second(track, rig_.T_C1C0())) out.tracks.push_back(*handed);
  return out;
}

void KltFrontend::take_over(TrackTransfer handover) {
  tracks_.end_all(TrackStatus::lost);
  tracks_.drop_ended();
  tracks_.begin_ids_at(handover.next_id);
  std::vector<double> inverse_depths;
  for (const TransferredTrack& handed : handover.tracks) {
    if (tracks_.full()) break;
    KltTrack track;  // its age is that of its history, in this camera
    track.id = handed.id;
    track.px = handed.px;
    track.normalised = handed.normalised;
    track.inverse_depth = handed.inverse_depth;
    inverse_depths.push_back(handed.inverse_depth);
    if (cut_patches(track, tracks_.free_patches(), handover.image)) tracks_.resume(track);
  }
  typical_depth_.update(inverse_depths);
  images_.start_from(std::move(handover.image), handover.t);
}

void KltFrontend::match_stereo(FrontendStats& stats) {
  stereo_.place(predictor_.at_exposures(rig_.T_C1C0(), images_.t(), images_.t_right()));
  std::vector<double> inverse_depths;
  inverse_depths.reserve(tracks_.size());
  for (KltTrack& track : tracks_) {
    track.right.reset();
    if (!measure_depth(track)) continue;
    inverse_depths.push_back(*track.inverse_depth);
    ++stats.stereo;
  }
  typical_depth_.update(inverse_depths);
}

/// By the depth image, or in the right one.
bool KltFrontend::measure_depth(KltTrack& track) {
  if (images_.has_depth_image()) {
    const auto depth = images_.depth_at(track.px);
    if (!depth) return false;
    track.right = observe_depth(track.px, track.normalised, *depth);
    track.inverse_depth = depth->value;
    return true;
  }
  if (images_.right().empty()) return false;
  const StereoMatch match = stereo_.match(tracks_.patches(track).newest, track.px, track.normalised, track.inverse_depth,
                                          images_.left(), images_.right(), searches_line(track));
  if (match.failure != StereoFailure::none) return false;
  track.right = observe(rig_.right(), match.px, match.normalised, options_.sigma_px);
  track.inverse_depth = match.inverse_depth;
  return true;
}

}  // namespace fbvins
