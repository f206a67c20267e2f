// SPDX-License-Identifier: Apache-2.0
// For tests: a camera in the IMU's axes that is turned and moved by hand among points, with the readings between its images.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/geometry/so3.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins::carried_by_hand {

inline constexpr double kFocal_px = 450, kPixel_sigma = 0.6, kMiddle_px = 240;
inline const Vec3 kBias(0.02, -0.01, 0.03);

/// `late_s`: the images' stamps, beyond the exposure.
struct Hand {
  double middle_px = kMiddle_px;
  double late_s = 0, line_delay_s = 0, jitter_s = 0, rate_radps = 1, moves = 1;
  Rng rng{7};
  std::vector<Vec3> points;

  Hand() {
    for (int i = 0; i < 400; ++i) points.emplace_back(rng.uniform(-6, 6), rng.uniform(-4, 4), rng.uniform(2, 7));
  }
  Vec3 rate(double t) const { return rate_radps * Vec3(std::sin(7 * t), std::cos(5 * t + 1), 0.6 * std::sin(9 * t)); }
  Vec3 position(double t) const { return moves * Vec3(0.15 * std::sin(3 * t), 0.1 * std::cos(4 * t), 0.1 * std::sin(2 * t)); }

  /// Images at 20 Hz with the readings between them, at 200 Hz.
  std::vector<TrackedFrame> frames(double seconds, Duration cut_by = {}) {
    constexpr double kStep_s = 0.0005;
    std::vector<Quat> turned{Quat::Identity()};
    for (double t = -0.5; t < seconds + 0.5; t += kStep_s)
      turned.push_back((turned.back() * so3_exp(Vec3(kStep_s * rate(t + kStep_s / 2)))).normalized());
    const auto orientation = [&](double t) {
      const double at =
          std::clamp((t + 0.5) / kStep_s, 0.0, static_cast<double>(turned.size() - 2));  // of points beside the camera
      const auto k = static_cast<std::size_t>(at);
      return turned[k].slerp(at - static_cast<double>(k), turned[k + 1]);
    };
    std::vector<TrackedFrame> out;
    double before = -0.05;
    for (int n = 0; 0.05 * n < seconds; ++n) {
      TrackedFrame frame;
      const double exposed = 0.05 * n, stamp = exposed + late_s + jitter_s * rng.uniform(-1, 1);
      frame.t = Time{} + Duration::from_seconds(10 + stamp);
      frame.imu.time_offset = cut_by;
      frame.imu.samples.push_back({frame.t - Duration::from_seconds(stamp - before), Vec3::Zero(), Vec3::Zero()});
      for (int k = static_cast<int>(std::ceil(before / 0.005)); k * 0.005 <= stamp; ++k) {
        const double t = k * 0.005;  // on the images' clock; on the IMU's it is later by what the frame was cut with
        const Vec3 noise(rng.normal(), rng.normal(), rng.normal());
        frame.imu.samples.push_back(
            {Time{} + Duration::from_seconds(10 + t), rate(t + cut_by.seconds()) + kBias + 0.005 * noise, Vec3::Zero()});
      }
      frame.imu.samples.push_back({frame.t, Vec3::Zero(), Vec3::Zero()});
      before = stamp;
      for (std::size_t i = 0; i < points.size(); ++i) {
        double rows = 0;
        Vec3 p = Vec3::Zero();
        for (int k = 0; k < 3; ++k) {  // the row says when, and when says which row
          const double t = exposed + line_delay_s * rows;
          p = orientation(t).conjugate() * Vec3(points[i] - position(t));
          rows = kFocal_px * p.y() / p.z();
        }
        const Vec2 pixel = kFocal_px * p.hnormalized() + kPixel_sigma * Vec2(rng.normal(), rng.normal());
        if (p.z() < 0.5 || std::abs(pixel.x()) > 320 || std::abs(pixel.y()) > kMiddle_px) continue;
        TrackedFeature f;
        f.id = TrackId{static_cast<std::int64_t>(i)};
        f.see(0, Observation{pixel + Vec2(320, middle_px), pixel / kFocal_px, kFocal_px / kPixel_sigma * Mat2::Identity()});
        frame.features.push_back(f);
      }
      out.push_back(std::move(frame));
    }
    return out;
  }
};

}  // namespace fbvins::carried_by_hand
