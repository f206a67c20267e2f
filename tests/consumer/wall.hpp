// SPDX-License-Identifier: Apache-2.0
// A synthetic flight: a stereo camera looks at a wall two metres ahead, rests for a second, then sways 0.3 m from side to
// side. On the wall are grey noise and round dots, and each dot has its own grey value.
#pragma once

#include <cmath>
#include <cstdint>
#include <fbvins/camera/camera.hpp>
#include <fbvins/types/sensor_event.hpp>
#include <memory>
#include <numbers>
#include <vector>

namespace wall {

inline constexpr int kWidth = 320, kHeight = 240;  // px
inline constexpr double kFocal_px = 200, kDepth_m = 2.0, kBaseline_m = 0.1;
inline constexpr int kDots = 48;
inline constexpr std::uint8_t kFirstDot = 200;  // grey value of dot 0; the wall itself is darker

/// B is the left camera: x right, y down, z forward.
inline fbvins::StereoRig rig() {
  fbvins::StereoRig rig;
  const fbvins::PinholeRadtan lens{.fx = kFocal_px, .fy = kFocal_px, .cx = 160, .cy = 120};
  rig.cameras.assign(2, {fbvins::Camera(lens, kWidth, kHeight), {}});
  rig.cameras[1].T_BC.p = fbvins::Vec3(kBaseline_m, 0, 0);
  return rig;
}

constexpr double kRate_radps = 4 * std::numbers::pi / 3;
inline double sway_m(double t_s) { return t_s < 1 ? 0 : 0.15 * (1 - std::cos(kRate_radps * (t_s - 1))); }
inline double sway_mps2(double t_s) { return t_s < 1 ? 0 : 0.15 * kRate_radps * kRate_radps * std::cos(kRate_radps * (t_s - 1)); }

/// Grey value of the wall's noise at (u, v) px of a camera at the start: smooth between the corners of squares of 12 px.
inline double noise(double u, double v) {
  const auto corner = [](std::int64_t i, std::int64_t k) {
    std::uint64_t h = static_cast<std::uint64_t>(i * 73856093) ^ static_cast<std::uint64_t>(k * 19349663);
    h = (h ^ (h >> 13)) * 0x9E3779B97F4A7C15ULL;
    return static_cast<double>((h >> 40) & 127);
  };
  const double x = u / 12, y = v / 12;
  const auto i = static_cast<std::int64_t>(std::floor(x)), k = static_cast<std::int64_t>(std::floor(y));
  const double a = x - static_cast<double>(i), b = y - static_cast<double>(k);
  return 40 + (1 - b) * ((1 - a) * corner(i, k) + a * corner(i + 1, k)) +
         b * ((1 - a) * corner(i, k + 1) + a * corner(i + 1, k + 1));
}

/// The image of a camera that has moved by x_m to the right.
inline std::shared_ptr<const fbvins::Image> seen_from(double x_m) {
  auto image = std::make_shared<fbvins::Image>(kWidth, kHeight);
  const double shift_px = x_m * kFocal_px / kDepth_m;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) image->at(u, v) = static_cast<std::uint8_t>(noise(u + shift_px, v));
  for (int dot = 0; dot < kDots; ++dot) {
    const double u0 = 20 + 46 * (dot % 8) - shift_px, v0 = 25 + 38 * (dot / 8);
    for (int v = static_cast<int>(v0) - 7; v <= static_cast<int>(v0) + 7; ++v)
      for (int u = static_cast<int>(u0) - 8; u <= static_cast<int>(u0) + 8; ++u)
        if (u >= 0 && u < kWidth && std::hypot(u - u0, v - v0) < 6) image->at(u, v) = static_cast<std::uint8_t>(kFirstDot + dot);
  }
  return image;
}

/// Events in order of time: 20 Hz images, 200 Hz readings.
inline std::vector<fbvins::SensorEvent> flight(int images) {
  std::vector<fbvins::SensorEvent> events;
  for (int k = 0; k <= (images - 1) * 10; ++k) {
    const double t_s = 0.005 * k;
    const fbvins::Time t{5'000'000LL * k};
    events.push_back(fbvins::ImuSample{t, fbvins::Vec3::Zero(), fbvins::Vec3(sway_mps2(t_s), -9.81, 0)});
    if (k % 10 == 0) events.push_back(fbvins::StereoFrame{t, {seen_from(sway_m(t_s)), seen_from(sway_m(t_s) + kBaseline_m)}});
  }
  return events;
}

}  // namespace wall
