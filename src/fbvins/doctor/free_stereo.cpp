// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/free_stereo.hpp"

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

}  // namespace

FreeStereo::FreeStereo() : extractor_(kOrb), rng_(1) {}

std::vector<StereoPoint> FreeStereo::match(const StereoRig& rig, const Image& left_image, const Image& right_image,
                                           const Pyramid& left, const Pyramid& right) {
  extractor_.extract(left_image.view(), left_, rig.left().mask().get());
  extractor_.extract(right_image.view(), right_, rig.right().mask().get());
  std::vector<StereoPoint> points;
  std::vector<Vec2> a, b;
  KltTemplate patch, back;
  for (const DescriptorMatch& m : match_descriptors(left_.descriptors, right_.descriptors, kMatching)) {
    const Vec2 from = left_.keypoints[static_cast<std::size_t>(m.a)].pixel,
               to = right_.keypoints[static_cast<std::size_t>(m.b)].pixel;
    if (!patch.cut(left, from, 0, kCoarsest)) continue;
    const KltResult there = klt_align(patch, right, to, kCoarsest, 0);
    if (!there.ok() || (there.px - to).norm() > kNear_px || !back.cut(right, there.px, 0, 0)) continue;
    const KltResult again = klt_align(back, left, from, 0, 0, kConvergedCheck_px);
    if (!again.ok() || (again.px - from).norm() > kBack_px) continue;
    const auto ray_left = rig.left().undistort(from), ray_right = rig.right().undistort(there.px);
    if (!ray_left || !ray_right) continue;
    points.push_back({from, there.px});
    a.push_back(*ray_left), b.push_back(*ray_right);
  }
  const EpipolarResult result = ransac_epipolar(a, b, std::nullopt, {.threshold = kLoose_px / rig.left().focal_px()}, rng_);
  std::vector<StereoPoint> kept;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (result.inlier[i] != 0) kept.push_back(points[i]);
  return kept;
}

}  // namespace fbvins
