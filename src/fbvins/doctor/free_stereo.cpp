// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/free_stereo.hpp"

#include <algorithm>

#include "fbvins/features/epipolar_ransac.hpp"
#include "fbvins/features/hamming.hpp"
#include "fbvins/features/klt.hpp"

namespace fbvins {
namespace {

constexpr OrbOptions kOrb{.max_features = 600, .levels = 4};
constexpr HammingOptions kMatching{.max_distance = 50, .max_ratio = 0.8, .mutual = true};
/// Accuracy of a keypoint; patch alignment that ends farther away has found something else.
constexpr double kNear_px = 3;
constexpr double kBack_px = 0.5;
/// Largest epipolar error of an inlier: a wrong lens model causes up to this much, a wrong match more.
constexpr double kLoose_px = 8;
constexpr int kCoarsest = 1;
/// Fewer matches are those of images that have little in common, as an image and one upside down: patches are compared as they
/// are.
constexpr std::size_t kFew = 15;

Image half_turned(const Image& image) {
  Image out(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y)
    std::reverse_copy(image.row(y), image.row(y) + image.width(), out.row(image.height() - 1 - y));
  return out;
}

}  // namespace

FreeStereo::FreeStereo() : extractor_(kOrb), rng_(1) {}

std::vector<StereoPoint> FreeStereo::match(const StereoRig& rig, const Image& left_image, const Image& right_image,
                                           const Pyramid& left, const Pyramid& right) {
  extractor_.extract(left_image.view(), left_, rig.left().mask().get());
  extractor_.extract(right_image.view(), right_, rig.right().mask().get());
  std::vector<StereoPoint> points = match_as(half_turned_, rig, right_image, left, right);
  if (points.size() >= kFew) return points;
  std::vector<StereoPoint> other = match_as(!half_turned_, rig, right_image, left, right);
  if (other.size() < kFew || other.size() < 2 * points.size()) return points;
  half_turned_ = !half_turned_;
  return other;
}

std::vector<StereoPoint> FreeStereo::match_as(bool half_turned, const StereoRig& rig, const Image& right_image,
                                              const Pyramid& left, const Pyramid& as_taken) {
  if (half_turned) {
    turned_image_ = fbvins::half_turned(right_image);
    turned_right_.build(turned_image_.view(), as_taken.levels());
  }
  const Pyramid& right = half_turned ? turned_right_ : as_taken;
  const Vec2 corner_px(right_image.width() - 1, right_image.height() - 1);
  const auto as_compared = [&](const Vec2& px) { return half_turned ? Vec2(corner_px - px) : px; };  // and back
  std::vector<StereoPoint> points;
  std::vector<Vec2> a, b;
  KltTemplate patch, back;
  for (const DescriptorMatch& m : match_descriptors(left_.descriptors, right_.descriptors, kMatching)) {
    const Vec2 from = left_.keypoints[static_cast<std::size_t>(m.a)].pixel,
               to = as_compared(right_.keypoints[static_cast<std::size_t>(m.b)].pixel);
    if (!patch.cut(left, from, 0, kCoarsest)) continue;
    const KltResult there = klt_align(patch, right, to, kCoarsest, 0);
    if (!there.ok() || (there.px - to).norm() > kNear_px || !back.cut(right, there.px, 0, 0)) continue;
    const KltResult again = klt_align(back, left, from, 0, 0, kConvergedCheck_px);
    if (!again.ok() || (again.px - from).norm() > kBack_px) continue;
    const auto ray_left = rig.left().undistort(from), ray_right = rig.right().undistort(as_compared(there.px));
    if (!ray_left || !ray_right) continue;
    points.push_back({from, as_compared(there.px)});
    a.push_back(*ray_left), b.push_back(*ray_right);
  }
  const EpipolarResult result = ransac_epipolar(a, b, std::nullopt, {.threshold = kLoose_px / rig.left().focal_px()}, rng_);
  std::vector<StereoPoint> kept;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (result.inlier[i] != 0) kept.push_back(points[i]);
  return kept;
}

}  // namespace fbvins
