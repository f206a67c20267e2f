// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/stereo_matches.hpp"

#include "fbvins/features/klt.hpp"
#include "fbvins/features/shi_tomasi.hpp"
#include "fbvins/frontend/klt_follower.hpp"
#include "fbvins/frontend/klt_stereo.hpp"

namespace fbvins {
namespace {

constexpr double kNearest_m = 0.35, kSpacing_px = 30;
constexpr int kMostCorners = 120;

int matches(const StereoRig& rig, const Pyramid& left, const Pyramid& right, const std::vector<Corner>& corners) {
  KltStereoMatcher matcher(rig, kNearest_m);
  int count = 0;
  KltTemplate patch;
  for (const Corner& corner : corners) {
    const auto normalised = rig.left().undistort(corner.px);
    if (!normalised || !patch.cut(left, corner.px, 0, kKltLevels - 1)) continue;
    count += matcher.match(patch, corner.px, *normalised, std::nullopt, left, right).failure == StereoFailure::none;
  }
  return count;
}

}  // namespace

StereoMatches count_stereo_matches(std::span<const StereoRig> rigs, std::span<const StereoFrame> frames) {
  StereoMatches out{0, std::vector<int>(rigs.size())};
  ShiTomasiDetector detector(kSpacing_px);
  Pyramid left, right;
  for (const StereoFrame& frame : frames) {
    if (!frame.left() || !frame.right() || frame.left()->width() != rigs[0].left().width() ||
        frame.right()->width() != rigs[0].right().width())
      continue;
    left.build(frame.left()->view(), kKltLevels);
    right.build(frame.right()->view(), kKltLevels);
    const std::vector<Corner>& corners = detector.detect(left, {}, kMostCorners, rigs[0].left().mask().get());
    out.corners += static_cast<int>(corners.size());
    for (std::size_t i = 0; i < rigs.size(); ++i) out.matched[i] += matches(rigs[i], left, right, corners);
  }
  return out;
}

}  // namespace fbvins
