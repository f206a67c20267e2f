// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/projector_dots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fbvins/features/shi_tomasi.hpp"

namespace fbvins {
namespace {

constexpr double kMostDots = 0.2;
constexpr double kDistance_px = 20;
constexpr int kLevels = 2, kCorners = 150, kFewestCorners = 60;

}  // namespace

bool is_bright_dot(const PyramidLevel& image, const Vec2& px) {
  const int x = static_cast<int>(std::lround(px.x())), y = static_cast<int>(std::lround(px.y()));
  constexpr int kRing = 4;
  if (x < kRing + 1 || y < kRing + 1 || x >= image.width - kRing - 1 || y >= image.height - kRing - 1) return false;
  int peak = 0;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) peak = std::max<int>(peak, image.row(y + dy)[x + dx]);
  int brightest = 0, darkest = 255;
  for (int i = -kRing; i <= kRing; ++i)
    for (const int value :
         {image.row(y - kRing)[x + i], image.row(y + kRing)[x + i], image.row(y + i)[x - kRing], image.row(y + i)[x + kRing]})
      brightest = std::max<int>(brightest, value), darkest = std::min<int>(darkest, value);
  return peak - brightest > 12 && peak - brightest > 0.4 * (brightest - darkest);
}

double share_of_dots(const Camera& camera, std::span<const StereoFrame> frames) {
  ShiTomasiDetector detector(kDistance_px);
  Pyramid left;
  double least = 1;
  int judged = 0;
  for (const StereoFrame& frame : frames) {
    if (!frame.left() || frame.left()->width() != camera.width() || frame.left()->height() != camera.height()) continue;
    left.build(frame.left()->view(), kLevels);
    const std::vector<Corner>& corners = detector.detect(left, {}, kCorners, camera.mask().get());
    if (static_cast<int>(corners.size()) < kFewestCorners) continue;
    const auto dots =
        std::ranges::count_if(corners, [&](const Corner& corner) { return is_bright_dot(left.level(0), corner.px); });
    least = std::min(least, static_cast<double>(dots) / static_cast<double>(corners.size()));
    ++judged;
  }
  return judged > 0 ? least : 0;
}

std::optional<Finding> check_dots(double share) {
  if (share <= kMostDots) return std::nullopt;
  Finding finding;
  finding.kind = FindingKind::projector_dots;
  finding.size = share, finding.unit = "of the features";
  finding.measured = fmt::format("{:.0f} % of the features are small bright spots", 100 * share);
  finding.expected = "few: a pattern of spots moves with the camera and hides the scene";
  finding.advice = "switch the camera's infrared projector off (emitter_enabled: 0)";
  return finding;
}

}  // namespace fbvins
