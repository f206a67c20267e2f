// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_extractor.hpp"

#include <algorithm>

#include "fbvins/geometry/triangulation.hpp"
#include "fbvins/imu/exposure_motion.hpp"

namespace fbvins {
namespace {

constexpr int kLevels = 6;       // of the scale pyramid
constexpr int kSearchLevel = 2;  // of the image pyramid, for the search along the epipolar curve
constexpr int kAlignLevel = 1;   // coarsest of the alignment that follows it
/// Nearest point searched for in the right image.
constexpr double kMinDepth_m = 0.4;
constexpr double kMinSearchCorrelation = 0.7;
/// The curve is nearly straight on the search level: it is projected at the ends of so many pieces.
constexpr int kPieces = 6;
/// Of the search level: the patch is 16 wide, so a peak is a few steps wide.
constexpr double kStep_px = 2.0;
constexpr int kMaxStepsOfAPiece = 64;
/// Largest distance from the epipolar curve after refinement.
constexpr double kEpipolar_px = 1.0;
/// Where a narrow patch moves farther than this, a wide one shows two things.
constexpr double kOtherThing_px = 1.0;
/// Refinement may leave the depths that were searched by this factor.
constexpr double kNearerThanSearched = 1.1;
/// Standard deviations: of a keypoint, times the scale of its level, and of a disparity.
constexpr double kKeypoint_px = 0.7, kDisparity_px = 0.25;
/// Negative disparities down to this are taken for points at infinity, not for wrong matches.
constexpr double kInfinity_px = 1.0;

/// Where the left camera was when it took its image, as seen from the right one when it took its own (S3, S4). None without
/// readings.
std::optional<Pose<C1, C0>> between_exposures(const StereoRig& rig, const Keyframe& keyframe, const Mat3& R_LB) {
  const ExposureOffsets& offsets = keyframe.images.offsets;
  if (offsets.of(0) == offsets.of(1)) return rig.T_C1C0();
  if (keyframe.imu.segments.empty()) return std::nullopt;
  const Vec3 gravity_B = R_LB.transpose() * Vec3(0, 0, -keyframe.imu.gravity_mps2);
  const Vec3 v_B = keyframe.T_WB.q.conjugate() * keyframe.v_WB;
  const ExposureMotion motion(keyframe.imu.segments.back(), keyframe.imu.bias, gravity_B);
  const auto body = [&](int camera) { return motion.body(offsets.of(camera).seconds(), v_B); };
  return (body(1) * rig.T_BC1).inverse() * (body(0) * rig.T_BC0);
}

}  // namespace

PlaceExtractor::PlaceExtractor(const StereoRig& rig, const PlaceExtractorOptions& options, Vocabulary vocabulary,
                               std::unique_ptr<DescriptorStage> stage)
    : rig_(rig),
      vocabulary_(std::move(vocabulary)),
      stage_(std::move(stage)),
      focal_px_(rig.left.focal_px()),
      orb_(OrbOptions{.max_features = options.max_features, .levels = kLevels}, stage_->changes_descriptors()) {
  if (rig.depth) depth_.emplace(rig);
}

Place PlaceExtractor::extract(const Keyframe& keyframe) {
  const Mat3 R_LB = (keyframe.gauge.q_LG * keyframe.gauge.T_GB.q).toRotationMatrix();
  return extract(keyframe.images, R_LB, between_exposures(rig_, keyframe, R_LB));
}

Place PlaceExtractor::extract(const StereoFrame& images, const Mat3& R_LB, const std::optional<Pose<C1, C0>>& T_C1C0) {
  Place place;
  place.focal_px = focal_px_;
  place.up_C0 = (R_LB * rig_.T_BC0.R()).transpose() * Vec3::UnitZ();
  if (!images.left) return place;
  orb_.extract(images.left->view(), found_, rig_.left.mask().get());
  stage_->improve(images.left->width(), images.left->height(), found_);
  const bool stereo_pair = images.right && T_C1C0;
  if (stereo_pair) {
    R_rl_ = T_C1C0->R(), p_rl_ = T_C1C0->p;
    left_.build(images.left->view(), kSearchLevel + 1);
    right_.build(images.right->view(), kSearchLevel + 1);
  }
  const bool has_depth_image = depth_ && depth_->is_usable(images.depth.get());
  const auto depth_of = [&](const Vec2& px, const Vec2& normalised) -> std::optional<MeasuredInverseDepth> {
    if (has_depth_image) return depth_->at(*images.depth, px);
    return stereo_pair ? stereo(px, normalised) : std::nullopt;
  };
  for (std::size_t i = 0; i < found_.size(); ++i) {
    const Keypoint& keypoint = found_.keypoints[i];
    const auto xy = rig_.left.undistort(keypoint.pixel);
    if (!xy) continue;
    PlaceFeature feature;
    feature.x = static_cast<float>(xy->x());
    feature.y = static_cast<float>(xy->y());
    feature.sigma_xy = static_cast<float>(kKeypoint_px * keypoint.scale / focal_px_);
    if (const auto depth = depth_of(keypoint.pixel, *xy)) {
      feature.inverse_depth = static_cast<float>(depth->value);
      feature.sigma_inverse_depth = static_cast<float>(depth->sigma);
    }
    place.features.push_back(feature);
    place.descriptors.push_back(found_.descriptors[i]);
  }
  place.words = vocabulary_.words_of(place.descriptors);
  return place;
}

std::optional<Vec2> PlaceExtractor::project(const Vec2& left_normalised, double inverse_depth) const {
  return rig_.right.project(R_rl_ * left_normalised.homogeneous() + inverse_depth * p_rl_);
}

/// Position of the best correlation along the epipolar curve, on a coarse level.
std::optional<Vec2> PlaceExtractor::search(const Vec2& left_normalised) const {
  const int l = std::min(kSearchLevel, right_.levels() - 1);
  const KltLevelTemplate& patch = patch_.levels[static_cast<std::size_t>(l)];
  if (!patch.valid) return std::nullopt;
  const double scale = 1 << l;
  float best = static_cast<float>(kMinSearchCorrelation);
  std::optional<Vec2> best_px, from = project(left_normalised, 0);
  for (int piece = 1; piece <= kPieces; ++piece) {
    const auto to = project(left_normalised, piece / (kPieces * kMinDepth_m));
    if (from && to) {
      const int steps = std::clamp(static_cast<int>((*to - *from).norm() / (kStep_px * scale)) + 1, 1, kMaxStepsOfAPiece);
      for (int i = 0; i < steps; ++i) {
        const Vec2 px = *from + (*to - *from) * (static_cast<double>(i) / steps);
        const float correlation = klt_correlation_about(patch, right_.level(l), px / scale);
        if (correlation > best) best = correlation, best_px = px;
      }
    }
    from = to;
  }
  return best_px;
}

std::optional<MeasuredInverseDepth> PlaceExtractor::stereo(const Vec2& left_px, const Vec2& left_normalised) {
  const int search_level = std::min(kSearchLevel, left_.levels() - 1);
  if (!patch_.cut(left_, left_px, search_level, search_level)) return std::nullopt;
  const auto start = search(left_normalised);
  if (!start || !patch_.cut(left_, left_px, 0, kAlignLevel)) return std::nullopt;
  const KltResult near = klt_align(patch_, right_, *start, kAlignLevel, 0);
  if (!near.ok() || !patch_.cut(left_, left_px, 0, 0, KltWindow::narrow)) return std::nullopt;
  const KltResult found = klt_align(patch_, right_, near.px, 0, 0);
  if (!found.ok() || (found.px - near.px).norm() > kOtherThing_px) return std::nullopt;
  if (!rig_.right.inside(found.px, 2) || rig_.right.hidden(found.px, kPatchBorder_px)) return std::nullopt;
  const auto right = rig_.right.undistort(found.px);
  if (!right) return std::nullopt;
  const Vec3 far = R_rl_ * left_normalised.homogeneous(), seen = right->homogeneous();
  const auto off_line = distance_from_epipolar_line(far, p_rl_, seen);
  if (!off_line || *off_line * focal_px_ > kEpipolar_px) return std::nullopt;
  const auto rho = inverse_depth_along(far, p_rl_, seen);
  if (!rho || far.z() + *rho * p_rl_.z() <= 0) return std::nullopt;
  // d(seen)/d(rho): by the part of the baseline that is across the ray
  const double across_m = (p_rl_.head<2>() - p_rl_.z() * seen.head<2>()).norm() / (far.z() + *rho * p_rl_.z());
  const double rho_per_px = 1 / (focal_px_ * across_m);
  if (*rho < -kInfinity_px * rho_per_px || *rho > kNearerThanSearched / kMinDepth_m) return std::nullopt;
  return MeasuredInverseDepth{std::max(*rho, 0.0), kDisparity_px * rho_per_px};
}

}  // namespace fbvins
