// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/collect.hpp"

#include <algorithm>

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/camera/depth_reader.hpp"
#include "fbvins/checkup/projector_dots.hpp"
#include "fbvins/checkup/stereo_order.hpp"
#include "fbvins/core/median.hpp"
#include "fbvins/doctor/fixed_view.hpp"
#include "fbvins/doctor/free_stereo.hpp"
#include "fbvins/doctor/stereo_fit.hpp"
#include "fbvins/doctor/stereo_step.hpp"
#include "fbvins/features/shi_tomasi.hpp"
#include "fbvins/frontend/klt_follower.hpp"
#include "fbvins/frontend/klt_stereo.hpp"
#include "fbvins/frontend/track_table.hpp"

namespace fbvins {
namespace {

/// Images held back until the rig moves: for how long, how many at most, and how many of them at least are matched in stereo.
constexpr double kPrelude_s = 2;
constexpr std::size_t kMostHeld = 60, kFewestHeldViews = 6;
/// Between two images whose stereo matches count, and between two whose features get depths.
constexpr double kStereoStep_s = 0.25, kDepthStep_s = 0.1;
/// Enough time in motion, and when to stop waiting for it.
constexpr double kMoving_s = 40, kLongest_s = 120;
/// Median motion of features between images with depths from which the rig is in motion.
constexpr double kMoving_px = 1.5;
/// From one image to the next: features that move, fewest of them, and their least share for the scene to move.
constexpr double kFeatureMoves_px = 0.75, kShareMoves = 0.25;
constexpr std::size_t kFewestMoving = 8;
constexpr int kFeatures = 150;
constexpr double kDistance_px = 22, kNearest_m = 0.25, kLongestGap_s = 0.6;

bool same(const std::shared_ptr<const Image>& a, const std::shared_ptr<const Image>& b) {
  if (!a || !b || a->empty() || a->width() != b->width() || a->height() != b->height()) return false;
  for (int y = 0; y < a->height(); ++y)
    if (!std::equal(a->row(y), a->row(y) + a->width(), b->row(y))) return false;
  return true;
}

}  // namespace

struct EvidenceCollector::State {
  explicit State(const StereoRig& rig)
      : images(rig, kKltLevels), follower(rig.left()), tracks(kFeatures), detector(kDistance_px), sampler(rig.has_right()) {
    evidence.rig = evidence.working_rig = rig;
    if (rig.depth) depths.emplace(rig);
  }

  void count_repeated(const StereoFrame& frame);
  std::vector<StereoView> views_of_few();
  bool as_named_after_all();
  void put_in_order();
  void end_prelude();
  void look(StereoFrame frame);
  void follow();
  void note_scene_motion();
  void detect();
  bool has_depths(const StereoFrame& frame) const {
    return depths ? depths->is_usable(frame.depth.get()) : !images.right().empty();
  }
  std::optional<double> depth_of(const KltTrack& track, const StereoFrame& frame);
  void match(SeenFrame& seen, const StereoFrame& frame);
  void note(SeenFrame& seen);
  bool enough() const {
    return moving_s >= kMoving_s ||
           (!evidence.stamps.empty() && (evidence.stamps.back() - evidence.stamps.front()).seconds() > kLongest_s);
  }

  Evidence evidence;
  std::vector<StereoFrame> held;
  bool prelude = true;
  StereoFrame before;
  FrameImages images;
  KltFollower follower;
  TrackTable<KltTrack, KltPatches> tracks;
  ShiTomasiDetector detector;
  FreeStereo free_stereo;
  ViewSampler sampler;
  StereoRealigner realigner;
  std::optional<KltStereoMatcher> stereo;  ///< of a pair
  std::optional<DepthReader> depths;       ///< of a camera with a depth sensor
  Time last_view, last_depths;
  double moving_s = 0;
};

void EvidenceCollector::State::count_repeated(const StereoFrame& frame) {
  ++evidence.repeated.frames;
  evidence.repeated.left += same(frame.left(), before.left());
  evidence.repeated.right += same(frame.right(), before.right());
  evidence.repeated.same_pair += same(frame.left(), frame.right());
  before = frame;
}

namespace {

std::vector<StereoFrame> few_of(const std::vector<StereoFrame>& frames) {
  std::vector<StereoFrame> few;
  const std::size_t step = std::max<std::size_t>(frames.size() / kFewestHeldViews, 1);
  for (std::size_t i = 0; i < frames.size(); i += step) few.push_back(frames[i]);
  return few;
}

}  // namespace

/// Matches of some of the held images, found without the extrinsics.
std::vector<StereoView> EvidenceCollector::State::views_of_few() {
  std::vector<StereoView> views;
  Pyramid left, right;
  for (const StereoFrame& frame : few_of(held)) {
    if (!frame.left() || !frame.right()) continue;
    left.build(frame.left()->view(), kKltLevels);
    right.build(frame.right()->view(), kKltLevels);
    views.push_back({frame.t, free_stereo.match(evidence.rig, *frame.left(), *frame.right(), left, right)});
  }
  return views;
}

/// A lens or camera far from its calibration can look like exchanged images. Then fitting the images as named takes fewer changes
/// of the calibration than fitting them exchanged.
bool EvidenceCollector::State::as_named_after_all() {
  std::vector<StereoView> views = views_of_few();
  const StereoFit as_named = fit_stereo(views, evidence.rig, nullptr, {});
  for (StereoView& view : views)
    for (StereoPoint& point : view.points) std::swap(point.left, point.right);
  const StereoFit as_swapped = fit_stereo(views, evidence.rig, nullptr, {});
  return as_named.changes.size() < as_swapped.changes.size() && as_named.remaining_px < 2 * as_swapped.remaining_px;
}

/// Undoes an exchange of left and right, and gives right images that are late or early to their left ones.
void EvidenceCollector::State::put_in_order() {
  evidence.order = stereo_order(evidence.rig, few_of(held));
  evidence.swapped = evidence.order.swapped() && !as_named_after_all();
  if (evidence.swapped)
    for (StereoFrame& frame : held) frame.swap_left_right();
  evidence.step = stereo_step(evidence.rig, held, free_stereo);
  realigner = StereoRealigner(evidence.step.lag);
  std::vector<StereoFrame> in_step;
  for (StereoFrame& frame : held)
    if (auto whole = realigner.push(std::move(frame))) in_step.push_back(std::move(*whole));
  held = std::move(in_step);
}

/// Fits the stereo pair to the held images; from here on features have depths.
void EvidenceCollector::State::end_prelude() {
  prelude = false;
  if (evidence.rig.has_right()) {
    put_in_order();
    const StereoFit fit = fit_stereo(views_of_few(), evidence.rig, nullptr, {});
    evidence.working_rig = fit.rig;
    stereo.emplace(evidence.working_rig, kNearest_m);
  }
  std::vector<StereoFrame> first = std::move(held);
  for (StereoFrame& frame : first) look(std::move(frame));
}

void EvidenceCollector::State::look(StereoFrame frame) {
  FrontendStats stats;
  images.take(frame, stats);
  if (images.forget_before_gap(kLongestGap_s)) {
    tracks.end_all(TrackStatus::lost);
    tracks.drop_ended();
  }
  if (images.left().empty()) return;
  if (images.has_before()) follow();
  else sampler.interrupt();
  note_scene_motion();
  detect();
  SeenFrame seen;
  seen.t = frame.t;
  seen.gradients = gradient_energies(images.left());
  const double slack_s = 0.3 * kDepthStep_s;
  if (has_depths(frame) && (evidence.frames.empty() || (frame.t - last_depths).seconds() > kDepthStep_s - slack_s)) {
    match(seen, frame);
    last_depths = frame.t;
  }
  if (!images.right().empty() && (evidence.stereo.empty() || (frame.t - last_view).seconds() > kStereoStep_s - slack_s)) {
    evidence.stereo.push_back(
        {frame.t, free_stereo.match(evidence.rig, *frame.left(), *frame.right(), images.left(), images.right())});
    last_view = frame.t;
  }
  note(seen);
  images.advance();
}

void EvidenceCollector::State::follow() {
  FrontendStats stats;
  std::vector<double> motion_px;
  for (KltTrack& track : tracks) {
    if (!follower.follow(track, tracks.patches(track), {}, 0, images, stats)) track.status = TrackStatus::lost;
    else motion_px.push_back((track.px - track.previous_px).norm());
  }
  tracks.drop_ended();
  if (median(motion_px) > kMoving_px * (images.t() - images.t_before()).seconds() / kDepthStep_s)
    moving_s += (images.t() - images.t_before()).seconds();
}

/// By the median feature of those that move: what is fixed in view does not.
void EvidenceCollector::State::note_scene_motion() {
  std::vector<double> x_px, y_px;
  for (const KltTrack& track : tracks) {
    const Vec2 moved_px = track.px - track.previous_px;
    if (track.age_frames > 0 && moved_px.norm() > kFeatureMoves_px) x_px.push_back(moved_px.x()), y_px.push_back(moved_px.y());
  }
  if (tracks.size() < kFewestMoving) sampler.interrupt();
  const bool moves =
      x_px.size() >= kFewestMoving && static_cast<double>(x_px.size()) > kShareMoves * static_cast<double>(tracks.size());
  sampler.add(images.t(), moves ? Vec2(median(x_px), median(y_px)) : Vec2::Zero(), images.left(), images.right());
}

void EvidenceCollector::State::detect() {
  std::vector<Vec2> occupied;
  for (const KltTrack& track : tracks) occupied.push_back(track.px);
  for (const Corner& corner :
       detector.detect(images.left(), occupied, kFeatures - static_cast<int>(tracks.size()), evidence.rig.left().mask().get())) {
    const auto normalised = evidence.rig.left().undistort(corner.px);
    if (!normalised || tracks.full()) continue;
    KltPatches& patches = tracks.free_patches();
    if (!patches.newest.cut(images.left(), corner.px, 0, kKltLevels - 1)) continue;
    KltTrack track;
    track.px = corner.px;
    track.normalised = *normalised;
    follower.set_reference(track, patches, images.left());
    tracks.start(track);
  }
}

/// Inverse: by the right image, or the depth image.
std::optional<double> EvidenceCollector::State::depth_of(const KltTrack& track, const StereoFrame& frame) {
  if (depths) {
    const auto measured = depths->at(*frame.depth, track.px);
    return measured ? std::optional(measured->value) : std::nullopt;
  }
  const auto ray = evidence.working_rig.left().undistort(track.px);
  if (!ray) return std::nullopt;
  const StereoMatch found =
      stereo->match(tracks.patches(track).newest, track.px, *ray, track.inverse_depth, images.left(), images.right());
  return found.failure == StereoFailure::none ? std::optional(found.inverse_depth) : std::nullopt;
}

void EvidenceCollector::State::match(SeenFrame& seen, const StereoFrame& frame) {
  seen.has_depths = true;
  for (KltTrack& track : tracks) track.inverse_depth = depth_of(track, frame);
}

void EvidenceCollector::State::note(SeenFrame& seen) {
  for (const KltTrack& track : tracks)
    seen.features.push_back({track.id.value, track.px, seen.has_depths ? track.inverse_depth.value_or(0) : 0,
                             is_bright_dot(images.left().level(0), track.px)});
  std::sort(seen.features.begin(), seen.features.end(), [](const SeenFeature& a, const SeenFeature& b) { return a.id < b.id; });
  evidence.frames.push_back(std::move(seen));
}

EvidenceCollector::EvidenceCollector(const StereoRig& rig) : state_(std::make_unique<State>(rig)) {}
EvidenceCollector::~EvidenceCollector() = default;

bool EvidenceCollector::push(const SensorEvent& event) {
  State& s = *state_;
  return std::visit(Overloaded{[&](const ImuSample& sample) {
                                 s.evidence.imu.push_back(corrected(sample, s.evidence.rig.imu_noise.axes));
                                 return true;
                               },
                               [](const AidingSample&) { return true; },  // not examined
                               [&](const StereoFrame& frame) { return !s.enough() && push_frame(frame); }},
                    event);
}

bool EvidenceCollector::push_frame(StereoFrame frame) {
  State& s = *state_;
  s.evidence.stamps.push_back(frame.t);
  frame.offsets += own_offsets(s.evidence.rig);
  s.evidence.untriggered = s.evidence.untriggered || frame.offsets.are_apart(0, 1);
  s.count_repeated(frame);
  if (!s.prelude) {
    if (s.evidence.swapped) frame.swap_left_right();
    if (auto whole = s.realigner.push(std::move(frame))) s.look(std::move(*whole));
    return !s.enough();
  }
  s.held.push_back(std::move(frame));
  if (s.held.size() < kMostHeld && (s.held.back().t - s.held.front().t).seconds() < kPrelude_s) return true;
  if (nearly_same(s.held.front(), s.held.back()))
    s.held.erase(s.held.begin(), s.held.begin() + static_cast<std::ptrdiff_t>(s.held.size() / 2));
  else s.end_prelude();
  return true;
}

Evidence EvidenceCollector::finish() {
  if (state_->prelude && !state_->held.empty()) state_->end_prelude();
  state_->evidence.views = state_->sampler.take();
  return std::move(state_->evidence);
}

}  // namespace fbvins
