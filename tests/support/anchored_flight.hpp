// SPDX-License-Identifier: Apache-2.0
// Private to tests of anchors: flights through a synthetic room that stands turned and shifted in a building, and what anchors
// measure there.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins::test_room {

/// The building's frame is not the room's.
inline const Pose<A, G> kT_AR(about_z(2.4), Vec3(20, -8, 3));
inline const Vec3 kAntenna_B(0.05, 0, 0.12);

inline Pose<A, B> truth_of(const Frame& f) { return kT_AR * f.truth; }
inline Vec3 noise(Rng& rng, double sigma) { return sigma * Vec3(rng.normal(), rng.normal(), rng.normal()); }

inline Anchor position(const Frame& f, Rng& rng, double sigma_m) {
  return PositionAnchor{.t = f.t,
                        .p_A = truth_of(f) * kAntenna_B + noise(rng, sigma_m),
                        .covariance = sigma_m * sigma_m * Mat3::Identity(),
                        .p_B = kAntenna_B};
}

/// Three tags on the room's walls; `named` is the number that the detector reads.
inline std::vector<Pose<A, Tag>> tags() {
  std::vector<Pose<A, Tag>> out;
  for (const auto& [yaw, p] :
       {std::pair(-1.57, Vec3(4, 0.5, 1.4)), std::pair(0.0, Vec3(0.4, 3, 1.6)), std::pair(1.57, Vec3(-4, -0.4, 1.2))})
    out.push_back(kT_AR * Pose<G, Tag>(about_z(yaw) * so3_exp(Vec3(M_PI / 2, 0, 0)), p));
  return out;
}

/// The tags in front of the camera, nearer than 6 m.
inline std::vector<Anchor> seen_tags(const Frame& f, Rng& rng, double wrong_share) {
  std::vector<Anchor> out;
  const std::vector<Pose<A, Tag>> all = tags();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Pose<B, Tag> T_BT = truth_of(f).inverse() * all[i];
    if (T_BT.p.x() < 0.7 * T_BT.p.norm() || T_BT.p.norm() > 6) continue;
    TagAnchor a{.t = f.t, .id = static_cast<int>(i), .T_AT = all[i], .T_BT = T_BT.boxplus(noise(rng, 0.01), noise(rng, 0.02))};
    a.covariance.diagonal() << Vec3::Constant(1e-4), Vec3::Constant(4e-4);
    if (rng.uniform() < wrong_share)
      a.id = static_cast<int>((i + 1 + rng.below(2)) % 3), a.T_AT = all[static_cast<std::size_t>(a.id)];
    out.push_back(a);
  }
  return out;
}

struct Errors {
  double m = 0, rad = 0;
  int known = 0;
};

inline Errors errors(const Trajectory<M>& in_M, const std::vector<Frame>& frames) {
  Errors e;
  std::size_t k = 0;
  for (const StampedPose<M>& p : in_M) {
    while (frames[k].t != p.t) ++k;
    const Pose<A, B> truth = truth_of(frames[k]);
    e.m += (p.T.p - truth.p).squaredNorm(), e.rad += so3_log(p.T.q.conjugate() * truth.q).squaredNorm(), ++e.known;
  }
  e.m = std::sqrt(e.m / e.known), e.rad = std::sqrt(e.rad / e.known);
  return e;
}

struct Flown {
  int moved = 0, refused = 0, taken = 0, before = 0;
  Errors causal, after;
};

template <class Anchors>
Flown fly(LoopCloser& closer, const std::vector<Frame>& frames, Anchors anchors_of, std::uint32_t reset_counter = 0) {
  Flown out;
  Trajectory<G> in_G;
  Trajectory<M> causal;
  for (const Frame& f : frames) {
    Keyframe k = keyframe(FrameId{f.t.ns / 1000}, f.t, f.odometry, reset_counter);
    k.anchors = anchors_of(f);
    const MapUpdate u = closer.process(f.place, k);
    in_G.push_back({f.t, f.odometry});
    out.moved += u.M_moved.has_value(), out.refused += u.stats.anchors_refused, out.taken += u.stats.anchors;
    out.before += !u.anchored;
    if (u.anchored && u.localised) causal.push_back({f.t, u.T_MG * f.odometry});
    EXPECT_LT((u.T_MW_smooth.p - u.T_MW.p).norm(), 1.0) << "no long way to another M";
  }
  closer.finish();
  out.causal = errors(causal, frames), out.after = errors(closer.corrected(in_G), frames);
  return out;
}

}  // namespace fbvins::test_room
