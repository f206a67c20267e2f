// SPDX-License-Identifier: Apache-2.0
// One camera before a corner of two textured walls: depths from the places where it was before.
#include "fbvins/loop/earlier_views.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "fbvins/loop/place_extractor.hpp"
#include "tests/support/noise_texture.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace earlier_views_test {

/// In G: z up; the walls meet at (4, 0), each turned by 45 degrees.
double distance_along(const Vec3& from, const Vec3& ray, int wall) {
  const Vec3 normal = Vec3(1, wall == 0 ? 1 : -1, 0).normalized();
  const double towards = normal.dot(ray), distance = (normal.dot(Vec3(4, 0, 0) - from)) / towards;
  return towards > 0 ? distance : std::numeric_limits<double>::infinity();
}

struct Hit {
  double distance_m;
  Vec2 on_wall;  ///< px of the texture
};

Hit hit(const Pose<G, C0>& T_GC, const Vec2& xy) {
  const Vec3 ray = T_GC.q * Vec3(xy.homogeneous());
  const double first = distance_along(T_GC.p, ray, 0), second = distance_along(T_GC.p, ray, 1);
  const double d = std::min(first, second);
  const Vec3 p = T_GC.p + d * ray;
  constexpr double kPerMetre = 75;
  return {d, {kPerMetre * (std::sqrt(2.0) * p.y() + (first < second ? 50 : 0)), kPerMetre * p.z()}};
}

StereoRig small_rig() {
  StereoRig rig = test_room::rig();
  for (MountedCamera& mounted : rig.cameras) mounted.camera = Camera(PinholeRadtan{230, 230, 188, 120}, 376, 240);
  return rig;
}

Pose<G, B> pose(double x, double y, double yaw_deg, double roll_deg = 0) {
  return {Quat(Eigen::AngleAxisd(yaw_deg * kDegree, Vec3::UnitZ()) * Eigen::AngleAxisd(roll_deg * kDegree, Vec3::UnitX())),
          Vec3(x, y, 0.1)};
}

Keyframe keyframe(int number, const Pose<G, B>& T_GB, double t_s = 0) {
  static const NoiseTexture texture(3, 20);
  const StereoRig rig = small_rig();
  const Pose<G, C0> T_GC = T_GB * rig.T_BC0();
  const auto xy = [&](const Vec2& px) { return *rig.left().undistort(px); };
  Keyframe k = test_room::keyframe(FrameId{number}, Time{} + Duration::from_seconds(t_s > 0 ? t_s : 0.3 * number), T_GB);
  k.images.t = k.t;
  k.images.set_image(0, std::make_shared<const Image>(render_texture(
                            752, 480, texture, [&](const Vec2& px) { return hit(T_GC, xy(px)).on_wall; }, 128, 40)));
  for (int v = 15; v < 240; v += 30)
    for (int u = 15; u < 376; u += 30) {
      const Vec2 px(u, v);
      k.landmarks.push_back({TrackId{u * 1000 + v}, px, rig.T_BC0() * Vec3(hit(T_GC, xy(px)).distance_m * xy(px).homogeneous())});
    }
  return k;
}

PlaceExtractor extractor() { return {with_one_camera(small_rig()), {.max_features = 200}, test_room::vocabulary()}; }

struct Depths {
  int known = 0, right = 0, points = 0;
  double chi2 = 0;  ///< mean, of those that are right
};

/// Against the truth, with three standard deviations.
Depths depths_of(const Place& place, const Pose<G, B>& T_GB) {
  Depths out;
  const Pose<G, C0> T_GC = T_GB * small_rig().T_BC0();
  for (const PlaceFeature& f : place.features) {
    if (!f.has_depth()) continue;
    const double off = (f.inverse_depth - 1 / hit(T_GC, f.xy()).distance_m) / f.sigma_inverse_depth;
    ++out.known;
    out.points += f.has_point();
    if (std::abs(off) > 3) continue;
    ++out.right;
    out.chi2 += off * off;
  }
  out.chi2 /= std::max(1, out.right);
  return out;
}

bool none_has_depth(const Place& place) {
  return std::ranges::none_of(place.features, [](const PlaceFeature& f) { return f.has_depth(); });
}

TEST(EarlierViews, GiveDepthsOfWhatIsSeenFromAnotherPlace) {
  struct Case {
    const char* name;
    Pose<G, B> before, now;
  };
  for (const Case& c :
       {Case{"sideways", pose(0, 0, 0), pose(0, 0.2, 0)}, Case{"sideways and turned", pose(0, 0, 0), pose(0.1, 0.25, -6, 3)},
        Case{"forwards", pose(0, 0, 0), pose(0.35, 0.02, 0)}, Case{"backwards, turned", pose(0, 0, 5), pose(-0.2, -0.2, 0)}}) {
    PlaceExtractor one = extractor();
    EXPECT_TRUE(none_has_depth(one.extract(keyframe(0, c.before)))) << "there is nothing before the first";
    const Place place = one.extract(keyframe(1, c.now));
    const Depths found = depths_of(place, c.now);
    ASSERT_GT(place.size(), 150u) << c.name;
    EXPECT_GT(found.points, static_cast<int>(place.size()) / 2) << c.name;
    EXPECT_GT(found.right, 0.98 * found.known) << c.name;
    EXPECT_LT(found.chi2, 1.5) << c.name;
  }
}

TEST(EarlierViews, ShowNoDepthFromATurnOnTheSpot) {
  PlaceExtractor one = extractor();
  const Vec3 lens = small_rig().T_BC0().p;
  const auto about_the_lens = [&](double yaw_deg) {
    Pose<G, B> T = pose(0, 0, yaw_deg);
    T.p -= T.q * lens;
    return T;
  };
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(none_has_depth(one.extract(keyframe(i, about_the_lens(5.0 * i))))) << i;
}

TEST(EarlierViews, AreOfOneFlightBetweenRestartsAndOfTheLastSeconds) {
  const Pose<G, B> before = pose(0, 0, 0), now = pose(0, 0.2, 0);
  const auto found = [&](std::uint32_t reset_counter, double t_s) {
    PlaceExtractor one = extractor();
    (void)one.extract(keyframe(0, before));
    Keyframe k = keyframe(1, now, t_s);
    k.reset_counter = reset_counter;
    return !none_has_depth(one.extract(k));
  };
  EXPECT_TRUE(found(0, 1));
  EXPECT_FALSE(found(1, 1)) << "where it was in the new gauge is not known";
  EXPECT_FALSE(found(0, 30)) << "the odometry has drifted since then";
}

/// Landmarks, which many images have measured, say how long a step of the odometry was.
TEST(EarlierViews, AreAsFarAwayAsTheLandmarksSay) {
  const Pose<G, B> before = pose(0, 0, 0), now = pose(0, 0.2, 0);
  const auto found = [&](double step_m) {
    PlaceExtractor one = extractor();
    (void)one.extract(keyframe(0, before));
    Keyframe k = keyframe(1, now);
    k.gauge.T_GB.p.y() = step_m;
    return one.extract(k);
  };
  for (const double step_m : {0.18, 0.22}) {
    const Depths depths = depths_of(found(step_m), now);
    EXPECT_GT(depths.known, 100) << step_m;
    EXPECT_GT(depths.right, 0.98 * depths.known) << step_m;
    EXPECT_LT(depths.chi2, 0.5) << step_m << ": 10 % are three standard deviations";
  }
  EXPECT_TRUE(none_has_depth(found(0.3))) << "it is too wrong for the images to be compared";
}

TEST(EarlierViews, AreKeptInAHover) {
  PlaceExtractor one = extractor();
  (void)one.extract(keyframe(0, pose(0, 0, 0)));
  Keyframe k = keyframe(1, pose(0, 0.2, 0));
  for (int i = 1; i < 20; ++i) {
    k.id = FrameId{i};
    k.t = k.images.t = Time{} + Duration::from_seconds(0.3 * i);
    EXPECT_FALSE(none_has_depth(one.extract(k))) << i;
  }
}

/// The nearest view measures worse than one that is farther away.
TEST(EarlierViews, TheOneThatMeasuresDepthsBestIsTaken) {
  EarlierViews views(small_rig());
  const Pose<B, C0> T_BC0 = small_rig().T_BC0();
  const Pose<G, B> before[] = {pose(0, 0.5, 60), pose(0, 0, 0), pose(0, 0.05, 0), pose(0, 0.12, 0)};  // the first looks elsewhere
  for (int i = 0; i < 4; ++i) views.add(keyframe(i, before[i]), before[i] * T_BC0);
  const Pose<G, B> now = pose(0, 0.18, 0);
  const auto best = views.best_for(keyframe(4, now), now * T_BC0);
  ASSERT_TRUE(best);
  EXPECT_NEAR(best->from.p.norm(), 0.18, 1e-9);
  EXPECT_GT(best->from.nearest_m, 1);
  EXPECT_LT(best->from.nearest_m, 4 - 0.18);
}

/// A stereo rig whose right camera delivers nothing any more.
TEST(EarlierViews, TakeThePlaceOfTheRightCamera) {
  PlaceExtractor pair(small_rig(), {.max_features = 200}, test_room::vocabulary());
  const Pose<G, B> before = pose(0, 0, 0), now = pose(0, 0.2, 0);
  (void)pair.extract(keyframe(0, before));
  PlaceExtractor one = extractor();
  (void)one.extract(keyframe(0, before));
  const Place of_pair = pair.extract(keyframe(1, now)), of_one = one.extract(keyframe(1, now));
  EXPECT_EQ(of_pair.features, of_one.features);
  EXPECT_GT(depths_of(of_pair, now).right, 80);
}

}  // namespace earlier_views_test
}  // namespace fbvins
