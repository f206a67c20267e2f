// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/outliers.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "fbvins/calibration/corner_noise.hpp"

namespace fbvins {
namespace {

// Of correct corners one in 270 000 is beyond this: nothing of their noise is cut off.
constexpr double kLargestDeviation = 5;
constexpr double kLargestLeftOut = 1.0 / 3;
constexpr std::size_t kFewestCorners = 6;
// Numbers are written with four decimals; noise below that is the file's.
constexpr double kSmallestNoise_px = 1e-5;

template <class Visit>
void each_corner(RigAdjustment& adjustment, Visit&& visit) {
  for (RigFrame& frame : adjustment.frames())
    for (SeenBoard& view : frame.views)
      for (SeenCorner& corner : view.corners) visit(frame, view, corner);
}

/// From the median of all distances, so that outliers have no say.
double robust_noise_px(RigAdjustment& adjustment) {
  std::vector<double> sizes;
  each_corner(adjustment, [&](const RigFrame& frame, const SeenBoard& view, const SeenCorner& corner) {
    sizes.push_back(adjustment.residual(frame, view, corner).norm());
  });
  return sizes.empty() ? 0 : std::max(kSmallestNoise_px, coordinate_noise(sizes));
}

/// Judges every corner; returns how many judgements changed. Views that do not fit, and frames without views, are removed.
int judge_corners(RigAdjustment& adjustment, double noise_px) {
  int changed = 0;
  each_corner(adjustment, [&](const RigFrame& frame, const SeenBoard& view, SeenCorner& corner) {
    const bool keep = adjustment.residual(frame, view, corner).norm() <= kLargestDeviation * noise_px;
    changed += keep != corner.kept;
    corner.kept = keep;
  });
  for (RigFrame& frame : adjustment.frames())
    changed += static_cast<int>(std::erase_if(frame.views, [](const SeenBoard& view) {
      const auto kept = static_cast<std::size_t>(std::ranges::count(view.corners, true, &SeenCorner::kept));
      return kept < kFewestCorners ||
             static_cast<double>(kept) < (1 - kLargestLeftOut) * static_cast<double>(view.corners.size());
    }));
  std::erase_if(adjustment.frames(), [](const RigFrame& frame) { return frame.views.empty(); });
  return changed;
}

double unbiased_noise_px(RigAdjustment& adjustment) {
  double sum = 0, count = 0;
  each_corner(adjustment, [&](const RigFrame& frame, const SeenBoard& view, const SeenCorner& corner) {
    if (!corner.kept) return;
    sum += adjustment.residual(frame, view, corner).squaredNorm();
    count += 2;
  });
  const double freedom = count - 6.0 * static_cast<double>(adjustment.frames().size()) - adjustment.parameter_count();
  return freedom > 0 ? std::sqrt(sum / freedom) : 0;
}

}  // namespace

double adjust_without_outliers(RigAdjustment& adjustment) {
  adjustment.solve({.spread_px = 1});
  adjustment.solve({.spread_px = 2 * robust_noise_px(adjustment)});
  for (int round = 0; round < 5; ++round) {
    const int changed = judge_corners(adjustment, robust_noise_px(adjustment));
    if (round > 0 && changed == 0) break;
    adjustment.solve({});
  }
  return unbiased_noise_px(adjustment);
}

}  // namespace fbvins
