// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera_path.hpp"

#include "fbvins/core/median.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

constexpr double kWindow_s = 4;  // in which the gyroscope's drift is nothing
constexpr double kTilted_rad = 0.05, kTilted = 5;

/// Turns since the first reading by the gyroscope alone.
class TurnTable {
 public:
  TurnTable(const std::vector<CalibrationReading>& readings, const Vec3& bias) : readings_(readings) {
    turns_.emplace_back(Quat::Identity());
    for (std::size_t i = 0; i + 1 < readings.size(); ++i) {
      const Vec3 rate = 0.5 * (readings[i].gyro_radps + readings[i + 1].gyro_radps) - bias;
      turns_.push_back((turns_.back() * so3_exp((readings[i + 1].t_s - readings[i].t_s) * rate)).normalized());
    }
  }

  Quat at(double t_s) const {
    const auto after = std::upper_bound(readings_.begin(), readings_.end(), t_s,
                                        [](double t, const CalibrationReading& r) { return t < r.t_s; });
    if (after == readings_.begin()) return turns_.front();
    if (after == readings_.end()) return turns_.back();
    const auto i = static_cast<std::size_t>(after - readings_.begin());
    const double part = (t_s - readings_[i - 1].t_s) / (readings_[i].t_s - readings_[i - 1].t_s);
    return turns_[i - 1].slerp(part, turns_[i]);
  }

 private:
  const std::vector<CalibrationReading>& readings_;
  std::vector<Quat> turns_;
};

/// Between two poses the gyroscope's turn, its error spread evenly.
Pose<T, B> between(const BodyPose& a, const BodyPose& b, double t_s, const TurnTable& turns) {
  const Quat from_a = turns.at(a.t_s).conjugate();
  const double part = (t_s - a.t_s) / (b.t_s - a.t_s);
  const Quat end = a.T_TB.q * from_a * turns.at(b.t_s), now = a.T_TB.q * from_a * turns.at(t_s);
  const Vec3 left = so3_log(end.conjugate() * b.T_TB.q);
  return {(now * so3_exp(part * left)).normalized(), Vec3(a.T_TB.p + part * (b.T_TB.p - a.T_TB.p))};
}

Pose<T, B> pose_at(const std::vector<BodyPose>& poses, double t_s, const TurnTable& turns) {
  const auto after = std::upper_bound(poses.begin(), poses.end(), t_s, [](double t, const BodyPose& p) { return t < p.t_s; });
  if (after != poses.begin() && after != poses.end()) return between(*std::prev(after), *after, t_s, turns);
  const BodyPose& nearest = after == poses.begin() ? poses.front() : poses.back();
  return {(nearest.T_TB.q * turns.at(nearest.t_s).conjugate() * turns.at(t_s)).normalized(), nearest.T_TB.p};
}

/// The knot of degree 5 that lies on a path of constant speed: the third of an interval's six.
double time_of_knot(int index, double spacing_s) { return (index - 2) * spacing_s; }

int knots_for(double duration_s, double spacing_s) {
  return std::max(1, static_cast<int>(std::ceil(duration_s / spacing_s - 1e-9))) + kSplineOrder - 1;
}

}  // namespace

std::vector<BodyPose> agreeing_with_gyro(const std::vector<BodyPose>& poses, const std::vector<CalibrationReading>& readings,
                                         const Vec3& gyro_bias_radps) {
  const TurnTable turns(readings, gyro_bias_radps);
  // Where the gyroscope's frame lies in T, by each pose: the same, but for a slow drift.
  std::vector<Quat> frames;
  for (const BodyPose& pose : poses) frames.push_back((pose.T_TB.q * turns.at(pose.t_s).conjugate()).normalized());
  std::vector<double> off_rad;
  std::size_t begin = 0, end = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    while (poses[begin].t_s < poses[i].t_s - kWindow_s) ++begin;
    while (end < poses.size() && poses[end].t_s <= poses[i].t_s + kWindow_s) ++end;
    Vec3 middle;
    for (int k = 0; k < 3; ++k) {
      std::vector<double> all;
      for (std::size_t j = begin; j < end; ++j) all.push_back(so3_log(frames[i].conjugate() * frames[j])(k));
      middle(k) = median(all);
    }
    off_rad.push_back(middle.norm());
  }
  const double limit_rad = std::max(kTilted_rad, kTilted * median_of(off_rad));
  std::vector<BodyPose> out;
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (off_rad[i] <= limit_rad) out.push_back(poses[i]);
  return out;
}

PoseSpline first_path(const std::vector<BodyPose>& poses, const std::vector<CalibrationReading>& readings,
                      const Vec3& gyro_bias_radps, double spacing_s, double duration_s) {
  const TurnTable turns(readings, gyro_bias_radps);
  std::vector<Pose<T, B>> knots;
  for (int k = 0; k < knots_for(duration_s, spacing_s); ++k) knots.push_back(pose_at(poses, time_of_knot(k, spacing_s), turns));
  return {spacing_s, std::move(knots)};
}

PoseSpline with_spacing(const PoseSpline& path, double spacing_s) {
  std::vector<Pose<T, B>> knots;
  for (int k = 0; k < knots_for(path.duration_s(), spacing_s); ++k) {
    const double t_s = time_of_knot(k, spacing_s), inside_s = std::clamp(t_s, 0.0, path.duration_s() - 1e-9);
    const SplineMotion m = path.at(inside_s);
    knots.push_back(m.T_TB.boxplus((t_s - inside_s) * m.v_TB, (t_s - inside_s) * m.w_TB_B));
  }
  return {spacing_s, std::move(knots)};
}

}  // namespace fbvins
