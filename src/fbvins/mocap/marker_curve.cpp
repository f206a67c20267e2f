// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/marker_curve.hpp"

#include "fbvins/core/median.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace fbvins {
namespace {

constexpr double kHalfWindow_periods = 2.3, kShortestHalfWindow_s = 0.01, kLargestHole_periods = 2.5;
constexpr int kFewest = 4;  // one more than a parabola needs

Duration median_interval(const MarkerTrack& track) {
  std::vector<Duration> intervals;
  for (std::size_t i = 1; i < track.size(); ++i) intervals.push_back(track[i].t - track[i - 1].t);
  return median(intervals);
}

bool seen_earlier(const MarkerPose& a, const MarkerPose& b) { return a.t < b.t; }

}  // namespace

MarkerCurve::MarkerCurve(MarkerTrack track) : track_(std::move(track)) {
  const double period_s = median_interval(track_).seconds();
  half_window_ = Duration::from_seconds(std::max(kHalfWindow_periods * period_s, kShortestHalfWindow_s));
  largest_hole_ = Duration::from_seconds(kLargestHole_periods * period_s);
}

std::optional<Pose<V, K>> MarkerCurve::at(Time t) const {
  const auto first = std::lower_bound(track_.begin(), track_.end(), MarkerPose{t - half_window_, {}}, seen_earlier);
  const auto end = std::upper_bound(first, track_.end(), MarkerPose{t + half_window_, {}}, seen_earlier);
  if (end - first < kFewest || first->t > t || std::prev(end)->t < t) return std::nullopt;
  const auto after = std::lower_bound(first, end, MarkerPose{t, {}}, seen_earlier);
  const auto nearest = after != first && (after == end || t - std::prev(after)->t < after->t - t) ? std::prev(after) : after;
  using Row6 = Eigen::Matrix<double, 1, 6>;
  Mat3 A = Mat3::Zero();
  Eigen::Matrix<double, 3, 6> b = Eigen::Matrix<double, 3, 6>::Zero();
  const double scale = 1 / half_window_.seconds();
  for (auto pose = first; pose != end; ++pose) {
    if (pose != first && pose->t - std::prev(pose)->t > largest_hole_) return std::nullopt;
    const double u = (pose->t - t).seconds() * scale;
    const Vec3 basis(1, u, u * u);
    Row6 value;
    value << (pose->T_VK.p - nearest->T_VK.p).transpose(), so3_log(nearest->T_VK.q.conjugate() * pose->T_VK.q).transpose();
    A += basis * basis.transpose();
    b += basis * value;
  }
  const Eigen::LDLT<Mat3> ldlt(A);
  const Eigen::Matrix<double, 3, 6> c = ldlt.solve(b);
  if (!c.allFinite()) return std::nullopt;
  const Vec3 p = c.block<1, 3>(0, 0).transpose(), theta = c.block<1, 3>(0, 3).transpose();
  return Pose<V, K>{(nearest->T_VK.q * so3_exp(theta)).normalized(), Vec3(nearest->T_VK.p + p)};
}

}  // namespace fbvins
