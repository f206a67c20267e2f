// SPDX-License-Identifier: Apache-2.0
// A room of points with descriptors, and drifting flights through it, for the tests of loop closure.
#pragma once

#include <cmath>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/loop/place.hpp"
#include "fbvins/loop/vocabulary_training.hpp"
#include "fbvins/types/keyframe.hpp"

namespace fbvins::test_room {

inline constexpr double kFocal = 460, kBaseline = 0.11, kPixel = 0.4;

struct World {
  std::vector<Vec3> points;
  std::vector<Descriptor> looks;
};

inline Descriptor random_descriptor(Rng& rng) {
  Descriptor d;
  for (auto& word : d.bits) word = (static_cast<std::uint64_t>(rng.next_u32()) << 32) | rng.next_u32();
  return d;
}

/// Points on the walls of a room of 8 x 6 m.
inline World room(std::uint64_t seed, int points = 2500) {
  Rng rng(seed);
  World w;
  for (int i = 0; i < points; ++i) {
    const double s = rng.uniform(-1, 1), z = rng.uniform(0, 3), in = rng.uniform(0, 0.8);
    switch (rng.below(4)) {
      case 0: w.points.push_back({4 - in, 3 * s, z}); break;
      case 1: w.points.push_back({-4 + in, 3 * s, z}); break;
      case 2: w.points.push_back({4 * s, 3 - in, z}); break;
      default: w.points.push_back({4 * s, -3 + in, z});
    }
    w.looks.push_back(random_descriptor(rng));
  }
  return w;
}

inline const Vocabulary& vocabulary() {
  static const Vocabulary v = [] {
    std::vector<std::vector<Descriptor>> images;
    for (std::uint64_t s = 0; s < 4; ++s) images.push_back(room(s).looks);
    return train_vocabulary("orb", images, {.branching = 8, .depth = 4, .min_members = 10});
  }();
  return v;
}

inline StereoRig rig() {
  StereoRig r;
  r.cameras.assign(2, {Camera(PinholeRadtan{kFocal, kFocal, 376, 240}, 752, 480), {}});
  // B: x forward, y left, z up; camera looks along x
  Mat3 R_BC;
  R_BC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  r.cameras[0].T_BC = {R_BC, Vec3(0.05, kBaseline / 2, 0)};
  r.cameras[1].T_BC = {R_BC, Vec3(0.05, -kBaseline / 2, 0)};
  return r;
}

/// A pair that looks ahead and one that looks back, whose cameras are 2 and 3.
inline StereoRig rig_that_looks_back() {
  StereoRig r = rig();
  const Pose<B, B> turned(Quat(Eigen::AngleAxisd(3.141592653589793, Vec3::UnitZ())), Vec3(0.02, 0, 0.01));
  r.cameras.insert(r.cameras.end(), {{r.left(), turned * r.T_BC0()}, {r.right(), turned * r.T_BC1().cast_frames<B, C0>()}});
  return r;
}

/// Without words.
inline Place view(const World& w, const Pose<G, B>& T_GB, Rng& rng) {
  const Pose<G, C0> T_GC = T_GB * rig().T_BC0();
  const Pose<C0, G> T_CG = T_GC.inverse();
  Place place;
  place.focal_px = kFocal;
  place.up_C0 = T_GC.q.conjugate() * Vec3::UnitZ();
  const double rho_px = 1 / (kFocal * kBaseline);
  for (std::size_t i = 0; i < w.points.size(); ++i) {
    const Vec3 p = T_CG * w.points[i];
    if (p.z() < 0.5 || std::abs(p.x() / p.z()) > 0.8 || std::abs(p.y() / p.z()) > 0.5 || rng.below(4) == 0) continue;
    PlaceFeature f;
    f.x = static_cast<float>(p.x() / p.z() + kPixel * rng.normal() / kFocal);
    f.y = static_cast<float>(p.y() / p.z() + kPixel * rng.normal() / kFocal);
    f.inverse_depth = static_cast<float>(1 / p.z() + kPixel * rng.normal() * rho_px);
    f.sigma_xy = static_cast<float>(kPixel / kFocal);
    f.sigma_inverse_depth = static_cast<float>(kPixel * rho_px);
    place.features.push_back(f);
    Descriptor d = w.looks[i];
    for (int b = 0; b < 16; ++b) d.bits[rng.below(4)] ^= std::uint64_t{1} << rng.below(64);
    place.descriptors.push_back(d);
  }
  return place;
}

inline Place seen(const World& w, const Pose<G, B>& T_GB, Rng& rng) {
  Place place = view(w, T_GB, rng);
  place.words = vocabulary().words_of(place.descriptors);
  return place;
}

/// Where the body is `s` seconds into the rounds that flight() makes: a smooth function.
inline Pose<G, B> true_pose(double s) {
  const double a = 0.35 * s;
  return {Quat(Eigen::AngleAxisd(a + 0.4 * std::sin(0.5 * s), Vec3::UnitZ())) *
              so3_exp(Vec3(0.05 * std::sin(s), 0.04 * std::cos(0.8 * s), 0)),
          Vec3(1.2 * std::cos(a), 0.9 * std::sin(a), 1.4 + 0.3 * std::sin(0.7 * s))};
}

inline Vec3 true_velocity(double s) {
  constexpr double h = 1e-4;
  return (true_pose(s + h).p - true_pose(s - h).p) / (2 * h);
}

/// Readings of a noise-free IMU with these biases on the way, by differences of the pose.
inline ImuSegment readings(Time from, Time to, const ImuBias& bias) {
  constexpr double h = 1e-3;
  ImuSegment segment;
  for (Time t = from; t <= to; t = t + Duration::from_seconds(0.005)) {
    const double s = t.seconds();
    const Pose<G, B> T = true_pose(s), before = true_pose(s - h), after = true_pose(s + h);
    const Vec3 acceleration = (after.p - 2 * T.p + before.p) / (h * h);
    segment.samples.push_back({t, so3_log(before.q.conjugate() * after.q) / (2 * h) + bias.gyro_radps,
                               T.q.conjugate() * Vec3(acceleration + Vec3(0, 0, 9.81)) + bias.accel_mps2});
  }
  segment.longest_gap = Duration::from_seconds(0.005);
  return segment;
}

struct Frame {
  Time t;
  Pose<G, B> truth, odometry;
  Place place;
};

/// The estimator's keyframe at this pose, in a level gauge.
inline Keyframe keyframe(FrameId id, Time t, const Pose<G, B>& T_GB, std::uint32_t reset_counter = 0) {
  Keyframe k;
  k.id = id;
  k.t = t;
  k.gauge.T_GB = T_GB;
  k.reset_counter = reset_counter;
  return k;
}

/// Rounds through the room looking outwards, five keyframes a second; the odometry drifts in position and yaw.
inline std::vector<Frame> flight(const World& w, int keyframes, double drift_m, double drift_deg, std::uint64_t seed,
                                 double start_s = 0) {
  Rng rng(seed);
  std::vector<Frame> frames;
  double yaw = 0;
  Vec3 offset = Vec3::Zero();
  for (int i = 0; i < keyframes; ++i) {
    const double s = start_s + 0.2 * i;
    const Pose<G, B> T = true_pose(s);
    const Quat turned(Eigen::AngleAxisd(yaw, Vec3::UnitZ()));
    frames.push_back(
        {Time{static_cast<std::int64_t>(s * 1e9)}, T, {Quat(turned * T.q), Vec3(turned * T.p + offset)}, seen(w, T, rng)});
    yaw += drift_deg * 0.01745 * rng.normal();
    offset += drift_m * Vec3(rng.normal(), rng.normal(), rng.normal());
  }
  return frames;
}

}  // namespace fbvins::test_room
