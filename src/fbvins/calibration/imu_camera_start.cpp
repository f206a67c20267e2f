// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera_start.hpp"
#include "fbvins/calibration/refused.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

constexpr double kShortestPair_s = 0.08, kLongestPair_s = 0.3, kLargestTurn_rad = 1;  // between two images
constexpr double kHole_s = 0.05;
constexpr int kFewestPairs = 10;
constexpr double kCoarse_s = 0.01, kFine_s = 0.001;
constexpr double kStrong = 0.75, kWeakest = 0.4, kStandsOut = 1.5;  // correlation; a weak one must stand out
constexpr double kAmbiguous = 0.97, kPeak_s = 0.5;

struct TurnPair {
  double from_s, to_s;
  Vec3 rate_C;
};

std::vector<TurnPair> pairs_of(const std::vector<SeenPose>& poses) {
  std::vector<TurnPair> pairs;
  for (std::size_t i = 0, k = 0; i + 1 < poses.size(); ++i) {
    while (k + 1 < poses.size() && poses[k].t_s < poses[i].t_s + kShortestPair_s) ++k;
    const SeenPose &a = poses[i], &b = poses[k];
    const double span_s = b.t_s - a.t_s;
    const Vec3 turn = so3_log(a.T_TC.q.conjugate() * b.T_TC.q);
    if (span_s > 0 && span_s <= kLongestPair_s && turn.norm() < kLargestTurn_rad) pairs.push_back({a.t_s, b.t_s, turn / span_s});
  }
  return pairs;
}

struct Moments {
  int count = 0;
  Vec3 sum_B = Vec3::Zero(), sum_C = Vec3::Zero();
  double square_B = 0;
  Mat3 square_C = Mat3::Zero(), cross = Mat3::Zero();  ///< cross: B by C
};

Moments moments_at(const std::vector<TurnPair>& pairs, const GyroIntegral& gyro, double offset_s) {
  Moments m;
  for (const TurnPair& pair : pairs) {
    const std::optional<Vec3> w = gyro.mean_rate(pair.from_s + offset_s, pair.to_s + offset_s);
    if (!w) continue;
    ++m.count;
    m.sum_B += *w, m.sum_C += pair.rate_C;
    m.square_B += w->squaredNorm();
    m.square_C += pair.rate_C * pair.rate_C.transpose();
    m.cross += *w * pair.rate_C.transpose();
  }
  if (m.count == 0) return m;
  m.square_B -= m.sum_B.squaredNorm() / m.count;
  m.square_C -= m.sum_C * m.sum_C.transpose() / m.count;
  m.cross -= m.sum_B * m.sum_C.transpose() / m.count;
  return m;
}

/// The rotation between rates that differ by noise and a constant (A3).
TurnMatch match_of(const Moments& m, double offset_s) {
  TurnMatch match;
  match.time_offset_s = offset_s;
  match.pairs = m.count;
  const Eigen::JacobiSVD<Mat3> svd(m.cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = svd.matrixU().determinant() * svd.matrixV().determinant() < 0 ? -1 : 1;
  const Vec3 s = svd.singularValues();
  const double scale = std::sqrt(std::max(1e-300, m.square_B * m.square_C.trace()));
  match.agreement = (s(0) + s(1) + sign * s(2)) / scale;
  match.mirrored_agreement = (s(0) + s(1) - sign * s(2)) / scale;
  const Mat3 R_BC = svd.matrixU() * Vec3(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  match.R_BC = Quat(R_BC).normalized();
  match.gyro_bias_radps = (m.sum_B - R_BC * m.sum_C) / m.count;
  match.gain = std::sqrt(m.square_B / std::max(1e-300, m.square_C.trace()));
  const Eigen::JacobiSVD<Mat3> spread(m.square_C / m.count);
  match.spread_radps = spread.singularValues().cwiseSqrt();
  return match;
}

}  // namespace

GyroIntegral::GyroIntegral(const std::vector<ImuSample>& readings, Time reference) {
  const auto at = [&](std::size_t i) { return (readings[i].t - reference).seconds(); };
  first_s_ = at(0);
  const auto count = static_cast<std::size_t>((at(readings.size() - 1) - first_s_) / step_s_) + 1;
  Vec3 sum = Vec3::Zero();
  double missing_s = 0;
  for (std::size_t i = 0; i + 1 < readings.size(); ++i) {
    const double from_s = at(i), span_s = at(i + 1) - from_s;
    const Vec3 &a = readings[i].gyro_radps, &b = readings[i + 1].gyro_radps;
    while (sum_.size() < count) {
      const double x = first_s_ + step_s_ * static_cast<double>(sum_.size()) - from_s;
      if (x >= span_s) break;
      sum_.emplace_back(sum + x * a + 0.5 * x * x / span_s * (b - a));
      missing_s_.push_back(missing_s + (span_s > kHole_s ? x : 0));
    }
    sum += 0.5 * span_s * (a + b);
    if (span_s > kHole_s) missing_s += span_s;
  }
  if (sum_.size() < count) sum_.push_back(sum), missing_s_.push_back(missing_s);
}

std::optional<Vec3> GyroIntegral::mean_rate(double from_s, double to_s) const {
  const double a = (from_s - first_s_) / step_s_, b = (to_s - first_s_) / step_s_;
  if (!(a >= 0) || !(b + 1 < static_cast<double>(sum_.size())) || !(a < b)) return std::nullopt;
  const auto i = static_cast<std::size_t>(a), k = static_cast<std::size_t>(b);
  if (missing_s_[k + 1] - missing_s_[i] > 0) return std::nullopt;
  const auto sum = [&](std::size_t n, double x) {
    return Vec3(sum_[n] + (x - static_cast<double>(n)) * (sum_[n + 1] - sum_[n]));
  };
  return Vec3((sum(k, b) - sum(i, a)) / (to_s - from_s));
}

std::optional<TurnMatch> match_turns_at(const std::vector<SeenPose>& poses, const GyroIntegral& gyro, double time_offset_s) {
  const Moments m = moments_at(pairs_of(poses), gyro, time_offset_s);
  if (m.count < kFewestPairs) return std::nullopt;
  return match_of(m, time_offset_s);
}

Result<TurnMatch> match_turns(const std::vector<SeenPose>& poses, const GyroIntegral& gyro, double max_offset_s) {
  const std::vector<TurnPair> pairs = pairs_of(poses);
  const int steps = static_cast<int>(std::ceil(max_offset_s / kCoarse_s));
  std::vector<TurnMatch> coarse;
  int most = 0;
  for (int i = -steps; i <= steps; ++i) {
    const Moments m = moments_at(pairs, gyro, i * kCoarse_s);
    coarse.push_back(m.count < kFewestPairs ? TurnMatch{} : match_of(m, i * kCoarse_s));
    most = std::max(most, coarse.back().pairs);
  }
  if (most == 0)
    return refused(
        fmt::format("the board is never seen in two images in a row while the IMU is there (offsets of the clocks up to {:g} s "
                    "were tried)",
                    max_offset_s));
  std::size_t best = 0;
  double mirrored = 0, runner_up = 0;
  for (TurnMatch& match : coarse)
    if (2 * match.pairs < most) match.agreement = match.mirrored_agreement = 0;
  for (std::size_t i = 0; i < coarse.size(); ++i) {
    if (coarse[i].agreement > coarse[best].agreement) best = i;
    mirrored = std::max(mirrored, coarse[i].mirrored_agreement);
  }
  for (const TurnMatch& match : coarse)
    if (std::abs(match.time_offset_s - coarse[best].time_offset_s) > kPeak_s) runner_up = std::max(runner_up, match.agreement);
  const double agreement = coarse[best].agreement;
  const bool found = agreement >= kStrong || (agreement >= kWeakest && agreement > kStandsOut * runner_up);
  if (!found && mirrored > kStrong)
    return refused(
        "the IMU turns as the camera does only if its axes are left-handed: one of its axes has the wrong sign, or two are "
        "swapped");
  if (!found)
    return refused(
        fmt::format("at no offset of the clocks up to {:g} s does the IMU turn as the camera does (best correlation {:.2f}): "
                    "is it the same recording, and was it turned irregularly?",
                    max_offset_s, agreement));
  if (runner_up > kAmbiguous * agreement)
    return refused(
        fmt::format("the offset of the clocks is not shown, because the motion repeats itself (another offset more than {:g} s "
                    "away fits as well): turn irregularly",
                    kPeak_s));
  const double centre_s = coarse[best].time_offset_s;
  std::vector<TurnMatch> fine;
  const int reach = static_cast<int>(1.5 * kCoarse_s / kFine_s);
  for (int i = -reach; i <= reach; ++i)
    fine.push_back(match_of(moments_at(pairs, gyro, centre_s + i * kFine_s), centre_s + i * kFine_s));
  const auto top = static_cast<std::size_t>(
      std::max_element(fine.begin(), fine.end(), [](const auto& a, const auto& b) { return a.agreement < b.agreement; }) -
      fine.begin());
  if (top == 0 || top + 1 == fine.size()) return fine[top];
  const double before = fine[top - 1].agreement, at = fine[top].agreement, after = fine[top + 1].agreement;
  const double curvature = before - 2 * at + after;
  const double offset_s = fine[top].time_offset_s + (curvature < 0 ? 0.5 * kFine_s * (before - after) / curvature : 0);
  return match_of(moments_at(pairs, gyro, offset_s), offset_s);
}

}  // namespace fbvins
