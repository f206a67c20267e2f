// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/hand_eye.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/core/median.hpp"
#include "fbvins/mocap/clock_match.hpp"
#include "fbvins/mocap/hand_eye_pairs.hpp"
#include "fbvins/mocap/hand_eye_solver.hpp"

namespace fbvins {

using namespace hand_eye;

namespace {

constexpr double kShortestPairing_s = 0.045;  // denser estimates than images repeat the same error
constexpr std::size_t kMostPairs = 6000;
constexpr double kFlip_rad = 0.26, kSwap_m = 0.25, kSwap_medians = 8;
// Largest standard deviations of a usable result; a motion that leaves more in some direction is refused.
constexpr double kWorstRotation_rad = 0.3 * std::numbers::pi / 180, kWorstLever_m = 0.01, kWorstClock_s = 2e-3;

/// At most kMostPairs poses, so far apart that no two share markers.
Trajectory<W> thinned(const Trajectory<W>& estimate, double spacing_s) {
  Trajectory<W> out;
  const double duration_s = estimate.empty() ? 0 : (estimate.back().t - estimate.front().t).seconds();
  const Duration spacing = Duration::from_seconds(std::max(spacing_s, duration_s / static_cast<double>(kMostPairs)));
  for (const StampedPose<W>& pose : estimate)
    if (out.empty() || pose.t - out.back().t >= spacing) out.push_back(pose);
  return out;
}

/// Runs of pairs with large residuals: there the system took the markers for another orientation, or for another body.
std::vector<MarkerFault> find_misreadings(const std::vector<HandEyePair>& pairs, const MarkerCalibration& c) {
  std::vector<double> distances;
  for (const HandEyePair& pair : pairs) distances.push_back(residual_of(pair, c).head<3>().norm());
  const double far_m = std::max(kSwap_m, kSwap_medians * median_of(distances));
  std::vector<MarkerFault> faults;
  bool inside = false;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double angle = residual_of(pairs[i], c).tail<3>().norm();
    const bool flip = angle > kFlip_rad;
    if (!flip && !(distances[i] > far_m)) {
      inside = false;
      continue;
    }
    const Time from = c.to_marker(pairs[i > 0 ? i - 1 : i].t), to = c.to_marker(pairs[std::min(i + 1, pairs.size() - 1)].t);
    if (!inside) faults.push_back({flip ? MarkerFaultKind::flip : MarkerFaultKind::swap, from, to});
    inside = true;
    faults.back().to = to;
    faults.back().angle_rad = std::max(faults.back().angle_rad, angle);
    faults.back().distance_m = std::max(faults.back().distance_m, distances[i]);
  }
  return faults;
}

std::string axis(const Vec3& direction) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", direction.x(), direction.y(), direction.z());
}

/// The worst direction of a block and its standard deviation.
std::pair<Vec3, double> worst_of(const HandEyeMatrix& covariance, int at) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(Mat3(covariance.block<3, 3>(at, at)));
  return {eigen.eigenvectors().col(2), std::sqrt(std::max(0.0, eigen.eigenvalues()(2)))};
}

Result<void> judge(const HandEye& found) {
  const auto refuse = [](const std::string& what) {
    return Error{ErrorCode::invalid_argument, "the motion does not show " + what};
  };
  const auto [about, angle] = worst_of(found.covariance, kTurnBK);
  if (!(angle <= kWorstRotation_rad))
    return refuse(
        fmt::format("how the markers are turned about {} of their own axes (sigma {:.2f} degrees): turn about other axes, too",
                    axis(about), angle * 180 / std::numbers::pi));
  const auto [along, length] = worst_of(found.covariance, kLever);
  if (!(length <= kWorstLever_m))
    return refuse(
        fmt::format("where the markers are along {} of the IMU's axes (sigma {:.0f} mm): tilt more, about more than one axis",
                    axis(along), length * 1e3));
  const double clock = std::sqrt(found.covariance(kOffset, kOffset));
  if (!(clock <= kWorstClock_s))
    return refuse(fmt::format("the offset of the clocks (sigma {:.1f} ms): fly and turn faster", clock * 1e3));
  return {};
}

}  // namespace

Time MarkerCalibration::to_estimate(Time marker) const {
  return marker + offset + Duration::from_seconds(drift * (marker - reference).seconds());
}

Time MarkerCalibration::to_marker(Time estimate) const {
  const double since_s = ((estimate - offset) - reference).seconds();
  return (estimate - offset) - Duration::from_seconds(since_s * drift / (1 + drift));
}

Result<HandEye> align_hand_eye(const MarkerTrack& track, const Trajectory<W>& estimate, const HandEyeOptions& options) {
  const auto match = match_clocks(track, estimate);
  if (!match) return match.error();
  MarkerCurve curve(track);
  const Trajectory<W> thin = thinned(estimate, std::max(kShortestPairing_s, 2 * curve.half_window().seconds()));
  MarkerCalibration clocks;
  clocks.offset = match->offset;
  clocks.reference = track.front().t + Duration{(track.back().t - track.front().t).ns / 2};
  const std::vector<HandEyePair> pairs = pair_up(curve, thin, clocks);
  constexpr std::size_t kFewestPairs = 50;
  if (pairs.size() < kFewestPairs)
    return Error{ErrorCode::invalid_argument,
                 fmt::format("only {} poses of the estimate have markers around them", pairs.size())};
  const auto start = start_hand_eye(pairs, clocks, options.level_world);
  if (!start) return start.error();

  const std::vector<MarkerFault> faults = find_misreadings(pairs, *start);
  MarkerTrack kept = track;
  for (const MarkerFault& fault : faults)
    std::erase_if(kept, [&](const MarkerPose& pose) { return pose.t >= fault.from && pose.t <= fault.to; });
  if (kept.size() < track.size() / 2)
    return Error{
        ErrorCode::invalid_argument,
        fmt::format("the markers do not fit the estimate for {:.0f} % of the flight: is the body flipped, or another one?",
                    100.0 * static_cast<double>(track.size() - kept.size()) / static_cast<double>(track.size()))};
  curve = MarkerCurve(kept);
  HandEyeSolver solver(curve, thin, *start, options);
  solver.run();
  HandEye found = solver.result();
  found.clock_correlation = match->correlation;
  found.faults = faults;
  found.kept = std::move(kept);
  if (Result<void> verdict = judge(found); !verdict) return verdict.error();
  return found;
}

Trajectory<W> body_truth(const MarkerTrack& track, const MarkerCalibration& c) {
  Trajectory<W> out;
  const Pose<W, V> T_WV = c.T_VW.inverse();
  const Pose<K, B> T_KB = c.T_BK.inverse();
  for (const MarkerPose& pose : track) out.push_back({c.to_estimate(pose.t), T_WV * pose.T_VK * T_KB});
  return out;
}

}  // namespace fbvins
