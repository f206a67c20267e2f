// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_extractor.hpp"

#include <cmath>

#include "fbvins/core/median.hpp"
#include "fbvins/imu/exposure_motion.hpp"

namespace fbvins {
namespace {

constexpr int kLevels = 6;  // of the scale pyramid
/// Standard deviation of a keypoint, times the scale of its level.
constexpr double kKeypoint_px = 0.7;
/// Landmarks whose depth an earlier view measures this well, relatively, are compared with it, so many at least; and how far they
/// may be off.
constexpr double kSureDepth = 0.1, kMostNearer = 0.2;
constexpr std::size_t kFewestCompared = 8;

Mat3 level_attitude(const Keyframe& keyframe) { return (keyframe.gauge.q_LG * keyframe.gauge.T_GB.q).toRotationMatrix(); }

/// Where the body was when a camera took its image, as seen from where it was at the stamp (S3, S4). None without readings.
std::optional<Pose<B, B>> at_exposure(const Keyframe& keyframe, int camera) {
  const Duration offset = keyframe.images.offsets.of(camera);
  if (offset == Duration{}) return Pose<B, B>{};
  if (keyframe.imu.segments.empty()) return std::nullopt;
  const Vec3 gravity_B = level_attitude(keyframe).transpose() * Vec3(0, 0, -keyframe.imu.gravity_mps2);
  const Vec3 v_B = keyframe.T_WB.q.conjugate() * keyframe.v_WB;
  const ExposureMotion motion(keyframe.imu.segments.back(), keyframe.imu.bias, gravity_B);
  return motion.body(offset.seconds(), v_B);
}

/// Where the left camera was when it took its image, as seen from the right one when it took its own.
std::optional<Pose<C1, C0>> between_exposures(const StereoRig& rig, const Keyframe& keyframe) {
  if (keyframe.images.offsets.of(0) == keyframe.images.offsets.of(1)) return rig.T_C1C0();
  const auto left = at_exposure(keyframe, 0), right = at_exposure(keyframe, 1);
  if (!left || !right) return std::nullopt;
  return (*right * rig.T_BC1()).inverse() * (*left * rig.T_BC0());
}

}  // namespace

PlaceExtractor::PlaceExtractor(const StereoRig& rig, const PlaceExtractorOptions& options, Vocabulary vocabulary,
                               std::shared_ptr<DescriptorStage> stage)
    : rig_(rig),
      vocabulary_(std::move(vocabulary)),
      stage_(std::move(stage)),
      orb_(OrbOptions{.max_features = options.max_features, .levels = kLevels}, stage_->changes_descriptors()),
      depths_(rig.left().focal_px()),
      earlier_(rig) {
  if (rig.depth) depth_.emplace(rig);
}

Place PlaceExtractor::extract(const Keyframe& keyframe) {
  const std::optional<Pose<G, C0>> T_GC = left_camera(keyframe);
  const StereoFrame& images = keyframe.images;
  const bool left_alone = images.left() && T_GC && !images.right() && !has_depth_image(images);
  bool second = false;
  if (left_alone) second = look_back(keyframe, *T_GC);
  else if (const auto T_C1C0 = between_exposures(rig_, keyframe)) second = look_right(images, *T_C1C0);
  Place place = extract(images, level_attitude(keyframe), second);
  if (T_GC) earlier_.add(keyframe, *T_GC);
  return place;
}

void PlaceExtractor::remember(const Keyframe& keyframe) {
  if (const std::optional<Pose<G, C0>> T_GC = left_camera(keyframe)) earlier_.add(keyframe, *T_GC);
}

/// When it took its image. None without readings.
std::optional<Pose<G, C0>> PlaceExtractor::left_camera(const Keyframe& keyframe) const {
  const std::optional<Pose<B, B>> moved = at_exposure(keyframe, 0);
  return moved ? std::optional(keyframe.gauge.T_GB * *moved * rig_.T_BC0()) : std::nullopt;
}

Place PlaceExtractor::extract(const StereoFrame& images, const Mat3& R_LB) {
  return extract(images, R_LB, look_right(images, rig_.T_C1C0()));
}

bool PlaceExtractor::has_depth_image(const StereoFrame& images) const { return depth_ && depth_->is_usable(images.depth.get()); }

bool PlaceExtractor::look_right(const StereoFrame& images, const Pose<C1, C0>& T_C1C0) {
  if (!images.left() || !images.right()) return false;
  depths_.set(images.left()->view(), images.right()->view(), {&rig_.right(), T_C1C0.R(), T_C1C0.p});
  return true;
}

bool PlaceExtractor::look_back(const Keyframe& keyframe, const Pose<G, C0>& T_GC) {
  const std::optional<EarlierView> earlier = earlier_.best_for(keyframe, T_GC);
  if (!earlier) return false;
  depths_.set(keyframe.images.left()->view(), earlier->image->view(), earlier->from);
  const std::optional<double> nearer = nearer_than(keyframe.landmarks);
  if (!nearer || std::abs(*nearer - 1) > kMostNearer) return false;
  depths_.stretch(*nearer);
  return true;
}

/// By what factor the second view shows landmarks nearer than they are, in the median (L32): many images have measured them.
std::optional<double> PlaceExtractor::nearer_than(const std::vector<KeyframeLandmark>& landmarks) {
  const Pose<C0, B> T_CB = rig_.T_BC0().inverse();
  std::vector<double> factors;
  for (const KeyframeLandmark& landmark : landmarks) {
    const double z = (T_CB * landmark.p_B).z();
    const auto xy = rig_.left().undistort(landmark.pixel);
    if (!xy || !(z > 0)) continue;
    const auto depth = depths_.at(landmark.pixel, *xy);
    if (depth && depth->sigma < kSureDepth * depth->value) factors.push_back(depth->value * z);
  }
  if (factors.size() < kFewestCompared) return std::nullopt;
  return median(factors);
}

Place PlaceExtractor::extract(const StereoFrame& images, const Mat3& R_LB, bool second) {
  Place place;
  place.focal_px = rig_.left().focal_px();
  place.up_C0 = (R_LB * rig_.T_BC0().R()).transpose() * Vec3::UnitZ();
  if (!images.left()) return place;
  orb_.extract(images.left()->view(), found_, rig_.left().mask().get());
  stage_->improve(images.left()->width(), images.left()->height(), found_);
  const bool by_depth_image = has_depth_image(images);
  const auto depth_of = [&](const Vec2& px, const Vec2& normalised) -> std::optional<MeasuredInverseDepth> {
    if (by_depth_image) return depth_->at(*images.depth, px);
    return second ? depths_.at(px, normalised) : std::nullopt;
  };
  for (std::size_t i = 0; i < found_.size(); ++i) {
    const Keypoint& keypoint = found_.keypoints[i];
    const auto xy = rig_.left().undistort(keypoint.pixel);
    if (!xy) continue;
    PlaceFeature feature;
    feature.x = static_cast<float>(xy->x());
    feature.y = static_cast<float>(xy->y());
    feature.sigma_xy = static_cast<float>(kKeypoint_px * keypoint.scale / place.focal_px);
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

}  // namespace fbvins
