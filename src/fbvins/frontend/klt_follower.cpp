// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/klt_follower.hpp"

namespace fbvins {
namespace {

/// A reference whose scale changes by more than this, or its inverse, is replaced.
constexpr double kSmallestScale = 0.65;
/// Correlation with the reference below which it is replaced.
constexpr double kMinReferenceCorrelation = 0.8;
constexpr int kTop = kKltLevels - 1;
constexpr int kFinest = 0;

}  // namespace

Vec2 KltFollower::predict(const KltTrack& track, const CameraMotion& motion, double typical_inverse_depth) const {
  if (!motion.has_rotation) return track.px;
  const auto carried = carry_point(camera_, motion, track.normalised, track.inverse_depth.value_or(typical_inverse_depth));
  if (!carried) return track.px;
  return track.px + carried->b_px - carried->a_px;
}

KltResult KltFollower::align(const KltTrack& track, KltTemplate& patch, const CameraMotion& motion, double typical_inverse_depth,
                             const FrameImages& images) const {
  const Vec2 start = predict(track, motion, typical_inverse_depth);
  const auto from_level = [&](int coarsest) {
    patch.extend(images.before(), track.px, coarsest);
    return klt_align(patch, images.left(), start, coarsest, kFinest, effort_.converged_px);
  };
  if (motion.has_translation && track.inverse_depth)
    if (const KltResult found = from_level(effort_.predicted_level); found.ok()) return found;
  return from_level(kTop);
}

KltResult KltFollower::align_to_reference(const KltTrack& track, const KltReference& reference, const Vec2& start_px,
                                          const Pyramid& left) {
  Mat2 J_pixel_normalised;
  camera_.distort(track.normalised, &J_pixel_normalised);
  // A small plane, fronto-parallel in the reference's image, as seen in the newest one.
  Eigen::Matrix<double, 2, 3> project;
  project << 1, 0, -track.normalised.x(), 0, 1, -track.normalised.y();
  const Mat2 J_now_reference =
      J_pixel_normalised * project * track.R_now_reference.leftCols<2>() / track.depth_ratio * track.J_normalised_pixel_reference;
  const double scale2 = J_now_reference.determinant();
  if (!(scale2 > kSmallestScale * kSmallestScale && scale2 * kSmallestScale * kSmallestScale < 1)) return {};
  if (!warped_.cut_warped(reference, J_now_reference.inverse())) return {};
  return klt_align(warped_, left, start_px, kFinest, kFinest);
}

void KltFollower::set_reference(KltTrack& track, KltPatches& patches, const Pyramid& left) const {
  patches.reference.take(left, track.px);
  Mat2 J_pixel_normalised;
  camera_.distort(track.normalised, &J_pixel_normalised);
  track.J_normalised_pixel_reference = J_pixel_normalised.inverse();
  track.R_now_reference.setIdentity();
  track.depth_ratio = 1;
}

/// Updates what depends on the camera's motion, and the normalised position.
bool KltFollower::carry(KltTrack& track, const Vec2& found_px, const CameraMotion& motion) const {
  const Vec3 p_now = motion.R_ba * track.normalised.homogeneous() + track.inverse_depth.value_or(0) * motion.p_ba;
  const auto normalised = camera_.undistort(found_px);
  if (!normalised || !(p_now.z() > 0)) return false;
  track.previous_px = track.px;
  track.previous_normalised = track.normalised;
  track.previous_inverse_depth = track.inverse_depth;
  track.normalised = *normalised;
  track.R_now_reference = motion.R_ba * track.R_now_reference;
  track.depth_ratio *= p_now.z();
  if (track.inverse_depth) *track.inverse_depth /= p_now.z();
  return true;
}

/// Whether a track's newest patch is found where the one before was.
bool KltFollower::comes_back(const KltTrack& track, const KltTemplate& newest, const Pyramid& before) const {
  const KltResult back = klt_align(newest, before, track.px, effort_.back_level, kFinest, kConvergedCheck_px);
  return back.ok() && (back.px - track.px).norm() <= kForwardBackward_px;
}

bool KltFollower::follow(KltTrack& track, KltPatches& patches, const CameraMotion& motion, double typical_inverse_depth,
                         const FrameImages& images, FrontendStats& stats) {
  KltResult found = align(track, patches.newest, motion, typical_inverse_depth, images);
  if (!found.ok()) {
    ++stats.lost_flow;
    return false;
  }
  if (!carry(track, found.px, motion)) return false;
  const KltResult to_reference = align_to_reference(track, patches.reference, found.px, images.left());
  const bool reference_holds = to_reference.ok() && to_reference.correlation > kMinReferenceCorrelation;
  if (reference_holds && (to_reference.px - found.px).norm() > kMaxCreep_px) {
    ++stats.lost_check;
    return false;
  }
  if (reference_holds) found.px = to_reference.px;
  if (!camera_.inside(found.px, kPatchBorder_px) || !patches.newest.cut(images.left(), found.px, kFinest, effort_.back_level)) {
    ++stats.lost_flow;
    return false;
  }
  if ((effort_.always_back || !reference_holds) && !comes_back(track, patches.newest, images.before())) {
    ++stats.lost_check;
    return false;
  }
  const auto normalised = camera_.undistort(found.px);
  if (!normalised) return false;
  track.px = found.px;
  track.normalised = *normalised;
  if (!reference_holds) set_reference(track, patches, images.left());
  ++track.age_frames;
  return true;
}

}  // namespace fbvins
