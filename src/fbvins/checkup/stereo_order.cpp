// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/stereo_order.hpp"

#include <fmt/format.h>

#include "fbvins/features/klt.hpp"
#include "fbvins/features/shi_tomasi.hpp"
#include "fbvins/frontend/either_camera.hpp"
#include "fbvins/frontend/klt_follower.hpp"
#include "fbvins/frontend/klt_stereo.hpp"

namespace fbvins {
namespace {

constexpr double kNearest_m = 0.35, kSpacing_px = 30;
constexpr int kMostCorners = 120, kFewestMatches = 30;
/// Matches that chance makes along a line are about a tenth of the true ones.
constexpr double kTimesMore = 3;

int matches(KltStereoMatcher& matcher, const Camera& camera, const Pyramid& left, const Pyramid& right,
            const std::vector<Corner>& corners) {
  int count = 0;
  KltTemplate patch;
  for (const Corner& corner : corners) {
    const auto normalised = camera.undistort(corner.px);
    if (!normalised || !patch.cut(left, corner.px, 0, kKltLevels - 1)) continue;
    count += matcher.match(patch, corner.px, *normalised, std::nullopt, left, right).failure == StereoFailure::none;
  }
  return count;
}

}  // namespace

bool StereoOrder::swapped() const { return as_swapped >= kFewestMatches && as_swapped > kTimesMore * as_named; }

StereoOrder stereo_order(const StereoRig& rig, std::span<const StereoFrame> frames) {
  const StereoRig other = mirrored(rig);
  KltStereoMatcher as_named(rig, kNearest_m), as_swapped(other, kNearest_m);
  ShiTomasiDetector detector(kSpacing_px);
  Pyramid left, right;
  StereoOrder order;
  for (const StereoFrame& frame : frames) {
    if (!frame.left() || !frame.right() || frame.left()->width() != rig.left().width() ||
        frame.right()->width() != rig.right().width())
      continue;
    left.build(frame.left()->view(), kKltLevels);
    right.build(frame.right()->view(), kKltLevels);
    const std::vector<Corner>& corners = detector.detect(left, {}, kMostCorners, rig.left().mask().get());
    order.features += static_cast<int>(corners.size());
    order.as_named += matches(as_named, rig.left(), left, right, corners);
    order.as_swapped += matches(as_swapped, other.left(), left, right, corners);
  }
  return order;
}

std::optional<Finding> check_stereo_order(const StereoOrder& order) {
  if (!order.swapped()) return std::nullopt;
  Finding finding;
  finding.kind = FindingKind::swapped_images;
  finding.size = order.as_swapped / static_cast<double>(order.features), finding.unit = "of the features";
  finding.measured = fmt::format("of {} features {} match with the two cameras' images exchanged, and {} as they are named",
                                 order.features, order.as_swapped, order.as_named);
  finding.expected = "a point lies further left in the right image than in the left one";
  finding.advice = "exchange the topics or folders of the cameras, or their entries in the calibration";
  return finding;
}

}  // namespace fbvins
