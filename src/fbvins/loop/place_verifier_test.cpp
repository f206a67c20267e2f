// SPDX-License-Identifier: Apache-2.0
// Two synthetic views of one cloud of points: RANSAC, refinement, verification.
#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/loop/place_verifier.hpp"

namespace fbvins {
namespace place_verifier_test {

constexpr double kFocal = 460;

Descriptor random_descriptor(Rng& rng) {
  Descriptor d;
  for (auto& word : d.bits) word = (static_cast<std::uint64_t>(rng.next_u32()) << 32) | rng.next_u32();
  return d;
}

struct Cloud {
  std::vector<Vec3> points_W;
  std::vector<Descriptor> descriptors;
};

Cloud cloud(int points, std::uint64_t seed) {
  Rng rng(seed);
  Cloud c;
  for (int i = 0; i < points; ++i) {
    c.points_W.push_back({rng.uniform(-4, 4), rng.uniform(-2.5, 2.5), rng.uniform(3, 7)});
    c.descriptors.push_back(random_descriptor(rng));
  }
  return c;
}

/// The view of a camera at T_WC with noise of `px` pixels on positions and disparities, 20 flipped bits.
Place view(const Cloud& c, const Pose<W, C0>& T_WC, double px, std::uint64_t seed) {
  Rng rng(seed);
  Place place;
  place.focal_px = kFocal;
  place.up_C0 = T_WC.q.conjugate() * Vec3(0, -1, 0);
  const double rho_per_px = 1 / (kFocal * 0.11);
  for (std::size_t i = 0; i < c.points_W.size(); ++i) {
    const Vec3 p = T_WC.inverse() * c.points_W[i];
    if (p.z() < 0.5) continue;
    const Vec2 xy = p.hnormalized();
    if (std::abs(xy.x()) > 0.8 || std::abs(xy.y()) > 0.5) continue;
    PlaceFeature f;
    f.x = static_cast<float>(xy.x() + px * rng.normal() / kFocal);
    f.y = static_cast<float>(xy.y() + px * rng.normal() / kFocal);
    f.inverse_depth = static_cast<float>(1 / p.z() + px * rng.normal() * rho_per_px);
    f.sigma_xy = static_cast<float>(px / kFocal);
    f.sigma_inverse_depth = static_cast<float>(px * rho_per_px);
    if (rng.below(5) == 0) f.inverse_depth = -1;
    place.features.push_back(f);
    Descriptor d = c.descriptors[i];
    for (int b = 0; b < 20; ++b) d.bits[rng.below(4)] ^= std::uint64_t{1} << rng.below(64);
    place.descriptors.push_back(d);
  }
  return place;
}

const Pose<W, C0> kThere(so3_exp(Vec3(0.1, -0.35, 0.05)), Vec3(0.9, -0.2, 0.5));

TEST(PlaceVerifier, FindsThePoseAndItsInformationIsConsistent) {
  const Cloud c = cloud(500, 1);
  PlaceVerifier verifier({});
  double nees = 0;
  constexpr int kRuns = 40;
  for (int run = 0; run < kRuns; ++run) {
    const Place candidate = view(c, {}, 0.5, 100 + static_cast<std::uint64_t>(run)),
                query = view(c, kThere, 0.5, 500 + static_cast<std::uint64_t>(run));
    verifier.set_query(query);
    const auto found = verifier.verify(candidate);
    ASSERT_TRUE(found) << verifier.last().pose.inliers.size();
    const CameraFromCamera truth(Quat(kThere.q.conjugate()), kThere.inverse().p);
    Vec6 e;
    e << truth.p - found->pose.T_qc.p, so3_log(found->pose.T_qc.q.conjugate() * truth.q);
    EXPECT_LT(e.head<3>().norm(), 0.04);
    EXPECT_LT(e.tail<3>().norm(), 0.008);
    nees += e.dot(found->pose.information * e) / kRuns;
  }
  EXPECT_GT(nees, 3.0);
  EXPECT_LT(nees, 11.0);
}

TEST(PlaceVerifier, RefusesStrangersAndPosesThatDefyGravity) {
  PlaceVerifier verifier({});
  const Place query = view(cloud(500, 1), kThere, 0.5, 2), stranger = view(cloud(500, 9), {}, 0.5, 3);
  verifier.set_query(query);
  EXPECT_FALSE(verifier.verify(stranger));
  Place tilted = view(cloud(500, 1), {}, 0.5, 4);
  ASSERT_TRUE(verifier.verify(tilted));
  tilted.up_C0 = so3_exp(Vec3(0, 0, 0.15)) * tilted.up_C0;
  EXPECT_FALSE(verifier.verify(tilted));
}

TEST(PlaceVerifier, APredictionReplacesTheSearch) {
  const Cloud c = cloud(500, 1);
  const Place query = view(c, kThere, 0.5, 2), candidate = view(c, {}, 0.5, 3);
  PlaceVerifier verifier({});
  verifier.set_query(query);
  const CameraFromCamera truth(Quat(kThere.q.conjugate()), kThere.inverse().p);
  const auto found = verifier.verify(candidate, {truth.boxplus(Vec3(0.05, 0.03, -0.04), Vec3(0.01, -0.01, 0.01)), 25});
  ASSERT_TRUE(found);
  EXPECT_LT((found->pose.T_qc.p - truth.p).norm(), 0.04);
}

TEST(PlaceVerifier, SameInputSameBits) {
  const Cloud c = cloud(400, 1);
  const Place query = view(c, kThere, 0.5, 2), candidate = view(c, {}, 0.5, 3);
  PlaceVerifier a({}), b({});
  a.set_query(query), b.set_query(query);
  const auto x = a.verify(candidate), y = b.verify(candidate);
  ASSERT_TRUE(x && y);
  EXPECT_EQ(x->pose.T_qc.p, y->pose.T_qc.p);
  EXPECT_EQ(x->pose.information, y->pose.information);
}

}  // namespace place_verifier_test
}  // namespace fbvins
