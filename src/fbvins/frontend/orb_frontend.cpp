// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_frontend.hpp"

#include <algorithm>
#include <utility>

#include "fbvins/core/stage_timer.hpp"
#include "fbvins/frontend/observe.hpp"

namespace fbvins {
namespace {

/// Bounds of the gap without images after which tracks end. It is as long as tracks are remembered (memory_s), and no longer
/// than the predictor's IMU readings span.
constexpr double kShortestGap_s = 0.3, kLongestGap_s = 1.4;
/// With fewer tracks than this share of those wanted new ones are started at once.
constexpr double kShareThatWaits = 0.5;

int count_observed(const OrbTracks& tracks) {
  return static_cast<int>(std::count_if(tracks.begin(), tracks.end(), [](const OrbTrack& t) { return t.observed; }));
}

OrbOptions extraction(const OrbFrontendOptions& options) { return {.max_features = options.max_keypoints}; }

}  // namespace

OrbFrontend::OrbFrontend(const StereoRig& rig, const OrbFrontendOptions& options, std::shared_ptr<DescriptorStage> stage)
    : options_(options),
      most_(options.max_features),
      spreads_work_(rig.has_right() && stage->changes_descriptors()),
      camera_(rig.left()),
      T_C1C0_(rig.T_C1C0()),
      images_(rig, kOrbAlignmentLevels),
      predictor_(rig.T_BC0()),
      describer_(extraction(options), stage, !rig.has_right()),
      improver_(std::move(stage)),
      tracks_(options.max_features + kMostUnobserved),
      matcher_(options.search_px),
      locator_(rig.left()),
      recogniser_(rig.left(), options.recognition, extraction(options).levels),
      outliers_(rig.left(), baseline_for_depths_m(rig), options.epipolar_px),
      starter_(rig.left(), options.max_features, options.min_distance_px),
      depth_(rig, options) {}

TrackedFrame OrbFrontend::process(const SensorPacket& packet, const StatePrior& prior) {
  TrackedFrame out;
  out.id = packet.id;
  out.t = packet.frame.t;
  out.imu = packet.imu;
  FrontendStats& stats = out.stats;
  CpuTimer timer;

  predictor_.add(packet.imu, prior);
  images_.take(packet.frame, stats);
  if (images_.forget_before_gap(longest_gap_s())) {
    tracks_.end_all(TrackStatus::out_of_view);
    drop_ended();
    unfinished_ = false;
  }
  out.cameras = {!images_.left().empty(), images_.has_depth()};
  stats.pyramid_ms = timer.lap_ms();
  recogniser_.forget_unlocated(images_.t());
  // Without a left image tracks stay as they are; the motion to the next image spans the gap.
  if (!out.has(0)) return out;

  if (std::exchange(unfinished_, false)) finish_before(stats);
  view_.t = images_.t();
  view_.T_GC = predictor_.camera_at(view_.t);
  outliers_.begin(view_);
  const ImageView left = packet.frame.left()->view();
  bool detected = true;
  if (images_.has_before()) {
    detected = follow(left, stats);
  } else {
    detect(left, stats);
    recogniser_.recognise(tracks_, view_, images_.left(), improver_, stats);
  }
  cut_patches(tracks_, images_.left(), camera_);
  drop_ended();
  if (detected && !unfinished_) starter_.start(tracks_, view_, images_.left(), stats);
  else stats.tracked = count_observed(tracks_);
  detection_.pass(detected, stats.tracked + stats.detected);
  stats.track_ms += timer.lap_ms() - stats.geometry_ms - stats.detect_ms;

  if (out.has(1)) {
    depth_.place(predictor_.at_exposures(T_C1C0_, images_.t(), images_.t_right()));
    depth_.match(tracks_, images_, stats);
  }
  out.features = features_of(tracks_, camera_, options_.sigma_px);
  stats.stereo_ms = timer.lap_ms();
  stats.boost_ms += improver_.take_ms();
  images_.advance();
  ++view_.index;
  return out;
}

/// Follows the tracks from the image before into this one (2.1.1, 2.2.3): prediction, alignment; in an image of which keypoints
/// are detected matching of the others; outlier checks. Returns whether they were.
bool OrbFrontend::follow(const ImageView& left, FrontendStats& stats) {
  const CameraMotion motion = predictor_.between(images_.t_before(), view_.t);
  predict(tracks_, camera_, motion, depth_.typical_inverse_depth());
  drop_ended();
  locator_.follow(tracks_, view_, images_, stats);
  const int followed = count_observed(tracks_);
  const bool detected = detection_.due(followed);
  if (detected) {
    unfinished_ = spreads_work_ && followed > kShareThatWaits * most_;
    detect(left, stats);
    const std::vector<int>& found = matcher_.match(tracks_, view_, motion.has_translation, improver_, stats);
    locator_.locate(tracks_, view_, images_, found, stats);
    if (!unfinished_) recogniser_.recognise(tracks_, view_, images_.left(), improver_, stats);
  }
  CpuTimer timer;
  outliers_.judge(tracks_, view_, predictor_, stats);
  drop_ended();
  if (detected) matcher_.count_inliers(tracks_, stats);
  thin_out(tracks_, most_, options_.min_distance_px);
  forget(tracks_, view_.t, options_.memory_s);
  drop_ended();
  stats.geometry_ms = timer.lap_ms();
  return detected;
}

/// What can wait until the next image has come, of the image before, whose keypoints the view still holds: known landmarks are
/// looked for and tracks are started. They are followed into the next image like all others.
void OrbFrontend::finish_before(FrontendStats& stats) {
  --view_.index;
  const std::size_t others = tracks_.size();
  recogniser_.recognise(tracks_, view_, images_.before(), improver_, stats);
  cut_patches(tracks_, images_.before(), camera_, others);
  drop_ended();
  starter_.start(tracks_, view_, images_.before(), stats);
  detection_.add(stats.detected);
  ++view_.index;
}

/// Extracts and describes keypoints of the left image (2.2.1, 2.2.2).
void OrbFrontend::detect(const ImageView& left, FrontendStats& stats) {
  CpuTimer timer;
  stats.boost_ms += describer_.describe(left, view_, camera_.mask().get());
  stats.detect_ms += timer.lap_ms();
}

void OrbFrontend::locate(const LandmarkUpdate& update) {
  const LandmarkUpdates::Kind kind = updates_.take(update);
  if (kind == LandmarkUpdates::Kind::repeated) return;
  if (kind == LandmarkUpdates::Kind::earlier_void) {
    recogniser_.clear(tracks_);
    predictor_.forget_state();
  }
  recogniser_.locate(update, tracks_);
}

bool OrbFrontend::can_reobserve(TrackId track) const {
  return recogniser_.remembers(track) ||
         std::any_of(tracks_.begin(), tracks_.end(), [&](const OrbTrack& t) { return t.id == track; });
}

void OrbFrontend::follow_at_most(int features) {
  most_ = std::min(features, options_.max_features);
  starter_.want(most_);
}

void OrbFrontend::stand_by(const SensorPacket& packet, const StatePrior& prior) {
  predictor_.add(packet.imu, prior);
  recogniser_.forget_unlocated(packet.frame.t);
}

TrackTransfer OrbFrontend::hand_over() {
  TrackTransfer out{images_.t_right(), images_.take_right(), {}, tracks_.next_id()};
  if (out.image.empty()) return out;
  improver_.improve(tracks_, view_, [](const OrbTrack&) { return true; });
  for (const OrbTrack& track : tracks_) {
    std::optional<TransferredTrack> handed = seen_by_second(track, T_C1C0_);
    if (!handed) continue;
    handed->descriptor = track.descriptor;
    handed->raw = track.raw;
    handed->level = track.level;
    handed->seen_from_G = track.seen_from_G;
    handed->p_G = track.p_G;
    out.tracks.push_back(*handed);
  }
  return out;
}

void OrbFrontend::take_over(TrackTransfer handover) {
  tracks_.end_all(TrackStatus::out_of_view);
  drop_ended();
  tracks_.begin_ids_at(handover.next_id);
  unfinished_ = false;
  view_.t = handover.t;
  view_.T_GC = predictor_.camera_at(view_.t);
  outliers_.begin(view_);
  std::vector<double> inverse_depths;
  for (const TransferredTrack& handed : handover.tracks)
    if (!tracks_.full() && resume(handed, handover.image)) inverse_depths.push_back(handed.inverse_depth);
  depth_.assume(inverse_depths);
  images_.start_from(std::move(handover.image), handover.t);
  ++view_.index;
}

bool OrbFrontend::resume(const TransferredTrack& handed, const Pyramid& image) {
  recogniser_.forget(handed.id);
  OrbPatches& patches = tracks_.free_patches();
  if (!patches.newest.cut(image, handed.px, 0, kOrbAlignmentLevels - 1)) return false;
  if (!patches.reference.take(image, handed.px, camera_, handed.normalised)) return false;
  OrbTrack track;
  track.id = handed.id;
  track.px = handed.px;
  track.normalised = handed.normalised;
  track.inverse_depth = handed.inverse_depth;
  track.age_frames = handed.age_frames;
  track.descriptor = handed.descriptor;
  track.raw = handed.raw;
  track.level = handed.level;
  track.seen_from_G = handed.seen_from_G;
  track.p_G = handed.p_G;
  track.last_seen = view_.t;
  track.see(view_.index);
  tracks_.resume(track);
  return true;
}

double OrbFrontend::longest_gap_s() const { return std::clamp(options_.memory_s, kShortestGap_s, kLongestGap_s); }

void OrbFrontend::drop_ended() {
  improver_.improve(tracks_, view_, [&](const OrbTrack& track) {
    return track.status == TrackStatus::out_of_view && recogniser_.wants(track, view_);
  });
  tracks_.drop_ended([&](const OrbTrack& track, const OrbPatches& patches) {
    if (track.status == TrackStatus::out_of_view) recogniser_.remember(track, patches.reference, view_, images_.t());
  });
}

}  // namespace fbvins
