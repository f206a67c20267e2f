// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/final_adjustment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "fbvins/loop/adjustment.hpp"
#include "fbvins/loop/map_front.hpp"

namespace fbvins {
namespace {

/// Keyframes before it that each keyframe is matched with, and how far from where the map predicts it a match may be.
constexpr int kNeighbours = 3;
constexpr double kMatchRadius_px = 8;
/// Odometry edges are weighted by the drift that the first solve finds, which is less than the one assumed while flying; at least
/// this share of its variance.
constexpr double kLeastDrift = 0.01;
/// Held-out points must fit better by this factor: results that gained less were as often worse as better.
constexpr double kBetter = 0.985;
/// The criteria are means of thousands of squared residuals: an increase by this factor is not chance.
constexpr double kWorse = 1.02;
/// Readings and anchors that fit to their noise need not fit better, nor steps within twice the standard deviation of the drift.
constexpr double kImuFits = 1, kAnchorsFit = 1, kDriftLimit = 4;

/// Why the result does not fit better than the start; empty where it does.
std::string objection(const Plausibility& before, const Plausibility& after) {
  if (after.held_out > before.held_out)
    return fmt::format("points held out fit worse than before: {:.3f} -> {:.3f} squared standard deviations", before.held_out,
                       after.held_out);
  if (after.held_out > kBetter * before.held_out)
    return fmt::format("points held out hardly fit better than before: {:.3f} -> {:.3f} squared standard deviations",
                       before.held_out, after.held_out);
  if (after.imu > std::max(kImuFits, kWorse * before.imu))
    return fmt::format("the IMU's readings fit worse than before: {:.2f} -> {:.2f} squared standard deviations", before.imu,
                       after.imu);
  if (after.anchors > std::max(kAnchorsFit, kWorse * before.anchors))
    return fmt::format("the anchors fit worse than before: {:.2f} -> {:.2f} squared standard deviations", before.anchors,
                       after.anchors);
  if (after.odometry > std::max(kDriftLimit, kWorse * before.odometry))
    return fmt::format("the odometry cannot have drifted so: {:.2f} -> {:.2f} squared standard deviations of its steps",
                       before.odometry, after.odometry);
  return {};
}

}  // namespace

FinalAdjustmentReport adjust_map(PlaceMap& map, const PlaceVerifierOptions& matching) {
  FinalAdjustmentReport report;
  if (map.empty()) return report;
  if (const Result<void> all = read_places(map); !all) {
    report.refused = all.error().message;
    return report;
  }
  const bool has_scales = std::ranges::any_of(map.sessions, [](const MapSession& s) { return s.log_scale != 0; });
  const std::optional<PlaceMap> metric = has_scales ? std::optional(in_metres(map)) : std::nullopt;
  const PlaceMap& measured = metric ? *metric : map;
  Adjustment adjustment(measured);
  for (const FeatureTrack& track : feature_tracks(measured, matching, kNeighbours, kMatchRadius_px)) adjustment.add(track);
  if (adjustment.empty()) return report;
  AdjustmentState x = adjustment.start();
  report.iterations = adjustment.solve(x);
  adjustment.drop_outliers(x);
  report.iterations += adjustment.solve(x, std::clamp(adjustment.drift_found(x), kLeastDrift, 1.0));
  report.keyframes = static_cast<int>(map.size());
  report.points = static_cast<int>(adjustment.points());
  report.observations = static_cast<int>(adjustment.observations());
  report.initial_rms_px = adjustment.rms_px(adjustment.start());
  report.final_rms_px = adjustment.rms_px(x);
  report.before = adjustment.judged(adjustment.start());
  report.after = adjustment.judged(x);
  report.refused = objection(report.before, report.after);
  if (!report.refused.empty()) return report;
  report.tilt_rad = std::sqrt(x.tilt[0] * x.tilt[0] + x.tilt[1] * x.tilt[1]);
  adjustment.write(x, map);
  return report;
}

}  // namespace fbvins
