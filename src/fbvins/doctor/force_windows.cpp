// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include "fbvins/doctor/force_problem.hpp"

namespace fbvins::doctor::force {
namespace {

constexpr double kWindow_s = 1.5, kStep_s = 0.095, kMargin_s = 0.05;
constexpr std::size_t kFewestSights = 6, kFewestTracks = 8, kMostTracks = 30;

/// Orientation, and what the position is by each unknown, integrated from a window's beginning to each reading.
class MotionOfReadings {
 public:
  MotionOfReadings(const ImuSeries& imu, Time from, Time to, const Vec3& gyro_bias) {
    const ImuSegment segment = imu.segment(from, to);
    At at;
    at.t = segment.samples.front().t, at.reading = segment.samples.front();
    all_.push_back(at);
    for (std::size_t i = 1; i < segment.samples.size(); ++i) {
      all_.back().next = segment.samples[i];
      all_.push_back(step(all_.back(), segment.samples[i], gyro_bias));
    }
    all_.back().next = all_.back().reading;
    bias_ = gyro_bias;
  }
  /// At a time within.
  Sight at(Time t) const {
    auto after = std::upper_bound(all_.begin(), all_.end(), t, [](Time time, const At& a) { return time < a.t; });
    if (after == all_.begin()) ++after;
    const At& before = *std::prev(after);
    ImuSample there = before.reading;
    const double whole_s = (before.next.t - before.t).seconds(), share = whole_s > 0 ? (t - before.t).seconds() / whole_s : 0;
    there.t = t;
    there.gyro_radps += share * (before.next.gyro_radps - before.reading.gyro_radps);
    there.accel_mps2 += share * (before.next.accel_mps2 - before.reading.accel_mps2);
    const At end = step(before, there, bias_);
    Sight sight;
    sight.t_s = (t - all_.front().t).seconds();
    sight.R = end.q.toRotationMatrix();
    sight.p_matrix = end.p_matrix, sight.p_bias = end.p_bias, sight.p_gyro = end.p_gyro, sight.turn_gyro = end.turn_gyro;
    return sight;
  }

 private:
  struct At {
    Time t;
    ImuSample reading, next;
    Quat q = Quat::Identity();
    Mat39 v_matrix = Mat39::Zero(), p_matrix = Mat39::Zero();
    Mat3 v_bias = Mat3::Zero(), p_bias = Mat3::Zero(), v_gyro = Mat3::Zero(), p_gyro = Mat3::Zero(), turn_gyro = Mat3::Zero();
  };
  static Mat39 by_matrix(const Mat3& R, const Vec3& reading) {
    Mat39 out;
    for (int k = 0; k < 9; ++k) out.col(k) = R.col(k / 3) * reading(k % 3);
    return out;
  }
  static At step(const At& from, const ImuSample& to, const Vec3& bias) {
    At out = from;
    const double dt = (to.t - from.t).seconds();
    out.t = to.t, out.reading = to;
    const Vec3 middle_rate = 0.5 * (from.reading.gyro_radps + to.gyro_radps) - bias;
    out.q = (from.q * so3_exp(Vec3(dt * middle_rate))).normalized();
    const Mat3 R0 = from.q.toRotationMatrix(), R1 = out.q.toRotationMatrix();
    out.turn_gyro -= 0.5 * dt * (R0 + R1);
    const auto integrate = [&](auto& p, auto& v, const auto& a0, const auto& a1) {
      const auto mean = (0.5 * (a0 + a1)).eval();
      p += dt * v + dt * dt * (a0 / 3 + a1 / 6);
      v += dt * mean;
    };
    integrate(out.p_matrix, out.v_matrix, by_matrix(R0, from.reading.accel_mps2), by_matrix(R1, to.accel_mps2));
    integrate(out.p_bias, out.v_bias, R0, R1);
    integrate(out.p_gyro, out.v_gyro, Mat3(-hat(Vec3(R0 * from.reading.accel_mps2)) * from.turn_gyro),
              Mat3(-hat(Vec3(R1 * to.accel_mps2)) * out.turn_gyro));
    return out;
  }

  std::vector<At> all_;
  Vec3 bias_ = Vec3::Zero();
};

/// The tracks that are seen most often, spread over the ids.
std::vector<Track> longest(std::map<std::int64_t, Track> tracks) {
  std::vector<Track> all;
  for (auto& [id, track] : tracks)
    if (track.sights.size() >= kFewestSights) all.push_back(std::move(track));
  std::ranges::stable_sort(all, [](const Track& a, const Track& b) { return a.sights.size() > b.sights.size(); });
  if (all.size() > kMostTracks) all.resize(kMostTracks);
  return all;
}

}  // namespace

std::vector<Window> windows_of(const Evidence& evidence, const ImuSeries& imu, const StereoRig& rig, double offset_s,
                               const Vec3& gyro_bias) {
  std::vector<Window> windows;
  const Duration offset = Duration::from_seconds(offset_s), margin = Duration::from_seconds(kMargin_s);
  const Mat3 R_BC = rig.T_BC0().R();
  const double line_s = rig.times(0).line_delay_s, middle = 0.5 * rig.left().height();
  for (std::size_t first = 0; first < evidence.frames.size();) {
    const Time from = evidence.frames[first].t;
    std::size_t last = first;
    while (last < evidence.frames.size() && (evidence.frames[last].t - from).seconds() <= kWindow_s) ++last;
    const Time to = evidence.frames[last - 1].t, begin = from + offset - margin;
    if ((to - from).seconds() > 0.8 * kWindow_s && imu.covers(begin, to + offset + margin)) {
      const MotionOfReadings motion(imu, begin, to + offset + margin, gyro_bias);
      std::map<std::int64_t, Track> tracks;
      Time before = from - margin - margin;
      for (std::size_t i = first; i < last; ++i) {
        const SeenFrame& frame = evidence.frames[i];
        if ((frame.t - before).seconds() < kStep_s) continue;
        before = frame.t;
        for (const SeenFeature& feature : frame.features) {
          const auto ray = rig.left().undistort(feature.px);
          if (!ray) continue;
          Sight sight = motion.at(frame.t + offset + Duration::from_seconds(line_s * (feature.px.y() - middle)));
          sight.ray_B = R_BC * ray->homogeneous().normalized();
          tracks[feature.id].sights.push_back(sight);
        }
      }
      Window window;
      window.tracks = longest(std::move(tracks));
      if (window.tracks.size() >= kFewestTracks) windows.push_back(std::move(window));
    }
    first = std::max(last, first + 1);
  }
  return windows;
}

}  // namespace fbvins::doctor::force
