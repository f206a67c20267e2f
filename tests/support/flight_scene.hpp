// SPDX-License-Identifier: Apache-2.0
// For tests: a flight known exactly, and what an odometry would keep of it: keyframes with small errors, readings with noise,
// and where the cameras see the points of a room. Pure functions; fixed seeds.
#pragma once

#include <vector>

#include "fbvins/calibration/flight_rig.hpp"
#include "fbvins/calibration/flight_tracks.hpp"
#include "fbvins/calibration/flight_view_term.hpp"
#include "tests/support/imu_test_motion.hpp"

namespace fbvins::test {

struct FlightSceneOptions {
  double duration_s = 18, keyframe_s = 0.25, noise_px = 0.3;
  double position_m = 0.6, rotation_rad = 0.35;  ///< amplitudes of the motion
  std::uint64_t seed = 1;
};

inline StereoRig flight_scene_rig() {
  StereoRig rig;
  rig.cameras.resize(2);
  rig.cameras[0].camera = Camera(PinholeRadtan{458.7, 457.3, 367.2, 248.4, -0.2834, 0.0740, 1.9e-4, 1.8e-5}, 752, 480);
  rig.cameras[1].camera = Camera(PinholeRadtan{457.6, 456.1, 379.9, 255.2, -0.2837, 0.0745, -1e-4, -3.6e-5}, 752, 480);
  rig.cameras[0].T_BC = {so3_exp(Vec3(0.05, 0.02, 1.55)), Vec3(-0.021, -0.065, 0.0098)};
  rig.cameras[1].T_BC = rig.T_BC0() * Pose<C0, C0>(so3_exp(Vec3(-0.002, 0.014, 0.001)), Vec3(0.11, 0.0004, 0.001));
  rig.time_offset_s = 0.004;
  return rig;
}

namespace flight_scene {

/// Points on the walls of a room around the motion.
inline std::vector<Vec3> points(Rng& rng) {
  std::vector<Vec3> out;
  while (out.size() < 400) {
    const Vec3 p(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1));
    if (p.norm() < 1 && p.norm() > 0.1) out.push_back(rng.uniform(2, 6) * p.normalized());
  }
  return out;
}

}  // namespace flight_scene

/// A flight with `rig`, exactly, as an odometry keeps it that believes in `believed_offset_s`.
inline FlightTracks simulated_flight_tracks(const StereoRig& rig, double believed_offset_s, const FlightSceneOptions& o) {
  Rng rng(o.seed);
  const Motion motion(o.position_m, o.rotation_rad);
  const FlightRig truth = flight_rig(rig);
  const std::vector<Vec3> points = flight_scene::points(rng);
  const ImuBias bias{{0.004, -0.002, 0.003}, {0.05, -0.03, 0.02}};
  const double late_s = rig.time_offset_s - believed_offset_s;
  constexpr std::int64_t kTrackLength = 12;  // keyframes
  FlightTracks out;
  const Duration step = Duration::from_seconds(o.keyframe_s), period = Duration::from_seconds(1 / out.noise.rate_hz);
  for (std::int64_t i = 0; static_cast<double>(i) * o.keyframe_s < o.duration_s; ++i) {
    FlightKeyframe k;
    k.t = Time{1'000'000'000 + i * step.ns};
    const double t = k.t.seconds();
    k.state = motion.state(t, bias);
    Vec15 d = Vec15::Zero();
    for (int n = 0; n < 9; ++n) d[n] = (n < 3 ? 0.01 : n < 6 ? 2e-3 : 0.02) * rng.normal();
    k.state = k.state.boxplus(d);
    if (i > 0) {
      ImuSegment segment = motion.segment(k.t - step, k.t, period, bias);
      add_noise(segment, out.noise, rng);
      k.imu.push_back(std::move(segment));
    }
    const NavState<W> seen_from = motion.state(t + late_s, bias);
    for (std::size_t n = 0; n < points.size(); ++n)
      for (int camera = 0; camera < rig.camera_count(); ++camera) {
        const auto pixel = view_of(truth, camera, {seen_from, {}, kGravity_mps2, 0}, points[n]);
        const double du = o.noise_px * rng.normal(), dv = o.noise_px * rng.normal();
        const auto first = static_cast<std::int64_t>(n % kTrackLength);
        const TrackId id{static_cast<std::int64_t>(n) * 1000 + (i + first) / kTrackLength};
        if (pixel && truth.cameras[static_cast<std::size_t>(camera)].inside(*pixel))
          k.views.push_back({id, camera, *pixel + Vec2(du, dv)});
      }
    out.keyframes.push_back(std::move(k));
  }
  out.keyframes.front().new_frame = true;
  return out;
}

}  // namespace fbvins::test
