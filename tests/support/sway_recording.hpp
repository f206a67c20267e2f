// SPDX-License-Identifier: Apache-2.0
// For tests of the whole system: a camera that sways in front of a textured wall, as events of its sensors.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "fbvins/pipeline/system.hpp"
#include "tests/support/noise_texture.hpp"

namespace fbvins::sway_recording {

inline constexpr int kWidth = 320, kHeight = 240;
inline constexpr double kFocal = 200, kDepth = 2.0, kBaseline = 0.1;  // px, m, m
inline constexpr std::int64_t kMs = 1'000'000;

/// B is the left camera: x right, y down, z forward.
inline StereoRig small_rig() {
  StereoRig rig;
  const Camera camera(PinholeRadtan{.fx = kFocal, .fy = kFocal, .cx = 160, .cy = 120}, kWidth, kHeight);
  rig.cameras.assign(2, {camera, {}});
  rig.cameras[1].T_BC.p = Vec3(kBaseline, 0, 0);
  return rig;
}

/// Metres to the right of the start: at rest for a second, then swaying 0.3 m twice in three seconds.
inline double sway_m(double t_s) { return t_s < 1 ? 0 : 0.15 * (1 - std::cos(4 * std::numbers::pi / 3 * (t_s - 1))); }
inline double sway_mps2(double t_s) {
  const double w = 4 * std::numbers::pi / 3;
  return t_s < 1 ? 0 : 0.15 * w * w * std::cos(w * (t_s - 1));
}

/// A textured wall two metres ahead, seen by a camera that slides along it.
class Wall {
 public:
  Wall()
      : wall_(render_texture(
            480, kHeight, NoiseTexture(3, 24), [](const Vec2& p) { return p; }, 120, 45)) {}

  std::shared_ptr<const Image> seen_from(double x_m) const {
    auto image = std::make_shared<Image>(kWidth, kHeight);
    const double shift = x_m * kFocal / kDepth + 20;
    const int whole = static_cast<int>(shift);
    const double part = shift - whole;
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u)
        image->at(u, v) =
            static_cast<std::uint8_t>(std::lround((1 - part) * wall_.at(u + whole, v) + part * wall_.at(u + whole + 1, v)));
    }
    return image;
  }

 private:
  Image wall_;
};

/// Events in order of time: 20 Hz images, 200 Hz readings.
inline std::vector<SensorEvent> sway(int images) {
  const Wall wall;
  std::vector<SensorEvent> events;
  for (int k = 0; k <= (images - 1) * 10; ++k) {
    const double t_s = 0.005 * k;
    const Time t{5 * kMs * k};
    events.push_back(ImuSample{t, Vec3::Zero(), Vec3(sway_mps2(t_s), -9.81, 0)});
    if (k % 10 == 0) events.push_back(StereoFrame{t, {wall.seen_from(sway_m(t_s)), wall.seen_from(sway_m(t_s) + kBaseline)}});
  }
  return events;
}

inline const std::vector<SensorEvent>& recording() {
  static const std::vector<SensorEvent> events = sway(44);
  return events;
}

template <class Matrix>
void append(std::string& bytes, const Matrix& m) {
  bytes.append(reinterpret_cast<const char*>(m.data()), sizeof(*m.data()) * static_cast<std::size_t>(m.size()));
}

/// The results in an odometry, as bytes.
inline std::string bytes_of(const Odometry& o) {
  std::string bytes = std::to_string(o.id.value) + " " + std::to_string(o.t.ns) + " " +
                      std::to_string(static_cast<int>(o.health.state)) + " " + std::to_string(o.stats.iterations) + " ";
  append(bytes, o.T_WB.p);
  append(bytes, o.T_WB.q.coeffs());
  append(bytes, o.v_WB);
  append(bytes, o.bias.gyro_radps);
  append(bytes, o.bias.accel_mps2);
  append(bytes, o.pose_covariance);
  return bytes;
}

inline System system_of(RunMode mode, SystemParts parts = {}, const std::string& frontend = "klt") {
  SystemOptions options;
  options.frontend.kind = frontend;
  Result<System> system = System::create(options, small_rig(), mode, std::move(parts));
  EXPECT_TRUE(system.ok()) << system.error().message;
  return std::move(*system);
}

inline void push_all(System& system, const std::vector<SensorEvent>& events) {
  for (const SensorEvent& event : events) ASSERT_TRUE(system.push(event));
}

}  // namespace fbvins::sway_recording
