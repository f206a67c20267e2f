// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/surface_view.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fbvins/core/rng.hpp"
#include "fbvins/estimator/estimator_setup.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace surface_view_test {

constexpr double kNoise_1pm = 0.001;

StereoRig rig() {
  StereoRig rig;
  rig.cameras.resize(1);
  rig.cameras[0].camera = Camera(PinholeRadtan{.fx = 230, .fy = 230, .cx = 188, .cy = 120, .k1 = -0.28, .k2 = 0.07}, 376, 240);
  rig.cameras[0].T_BC = {(Mat3() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished(), Vec3(0.02, 0.05, 0.01)};
  return with_depth(rig, {.noise_at_1m_m = kNoise_1pm});
}

/// What the sensor sees of a room's corner: a wall at x = 3 m, one at y = 2 m, the floor at z = -1 m; of the wall alone, if
/// asked.
std::shared_ptr<const DepthImage> seen_from(const Pose<G, B>& T_GB, bool wall_alone, std::uint64_t seed) {
  const StereoRig r = rig();
  const Pose<G, C0> T_GC = T_GB * r.T_BC0();
  Rng rng(seed, 1);
  auto image = std::make_shared<DepthImage>(DepthImage{r.left().width(), r.left().height(), {}});
  for (int y = 0; y < image->height; ++y)
    for (int x = 0; x < image->width; ++x) {
      double rho = 0;
      if (const auto ray = r.left().undistort(Vec2(x, y))) {
        const Vec3 d = T_GC.q * ray->homogeneous();
        rho = d.x() / (3 - T_GC.p.x());
        if (!wall_alone) rho = std::max({rho, d.y() / (2 - T_GC.p.y()), d.z() / (-1 - T_GC.p.z())});
      }
      const double noisy = rho + kNoise_1pm * rng.normal();
      image->mm.push_back(rho > 0 && noisy > 0.02 ? static_cast<std::uint16_t>(std::lround(1000 / noisy)) : 0);
    }
  return image;
}

Frame frame_at(int id, const Pose<G, B>& T_GB, bool wall_alone, bool keyframe = true) {
  Frame f;
  f.id = FrameId{id};
  f.state.T_FB = T_GB;
  f.keyframe = keyframe;
  f.depth = seen_from(T_GB, wall_alone, static_cast<std::uint64_t>(id));
  return f;
}

Calibration calibration() { return calibration_of(rig()); }
const Pose<G, B> kThere(so3_exp(Vec3(0.02, -0.1, 0.35)), Vec3(0.1, -0.05, 0.08));

FrameList window_of(bool wall_alone) {
  FrameList window;
  window.add(frame_at(1, {}, wall_alone));
  return window;
}

/// Distances in sigmas, if the newest frame lies at `T_rn` from the reference.
std::vector<double> sigmas(const SurfaceFactor& view, const Pose<B, B>& T_rn) {
  std::vector<double> out;
  for (const SurfaceDistance& d : view.distances()) out.push_back(d.inverse_sigma_1pm * d.normal_B.dot(T_rn * d.p_B - d.on_it_B));
  return out;
}

double rms(const std::vector<double>& values) {
  double squares = 0;
  for (const double v : values) squares += v * v;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

TEST(SurfaceFinder, PlacesLieOnTheSurfacesOfTheReference) {
  for (const bool wall_alone : {false, true}) {
    const auto view = SurfaceFinder(rig()).find(frame_at(2, kThere, wall_alone), window_of(wall_alone), calibration());
    ASSERT_TRUE(view);
    EXPECT_EQ(view->reference(), FrameId{1});
    EXPECT_GT(view->distances().size(), 60u);
    EXPECT_LT(rms(sigmas(*view, kThere.cast_frames<B, B>())), 1);
  }
}

TEST(SurfaceFinder, ACornerShowsAllOfAShiftAndAWallItsDistance) {
  const SurfaceFinder finder(rig());
  for (const bool wall_alone : {false, true}) {
    const auto view = finder.find(frame_at(2, kThere, wall_alone), window_of(wall_alone), calibration());
    ASSERT_TRUE(view);
    const auto shifted = [&](const Vec3& by) { return rms(sigmas(*view, {kThere.q, Vec3(kThere.p + by)})); };
    EXPECT_GT(shifted(Vec3(0.1, 0, 0)), 3);
    for (const Vec3& along : {Vec3(0, 0.1, 0), Vec3(0, 0, 0.1)})
      EXPECT_EQ(shifted(along) > 1.5, !wall_alone) << along.transpose();
  }
}

TEST(SurfaceFinder, TheEarliestKeyframeThatShowsEnoughIsTheReference) {
  const SurfaceFinder finder(rig());
  FrameList window;
  const Pose<G, B> away(so3_exp(Vec3(0, 0, 2.5)), Vec3::Zero());
  window.add(frame_at(1, away, false));       // shows nothing of it
  window.add(frame_at(2, {}, false, false));  // no keyframe
  window.add(frame_at(3, {}, false));
  window.add(frame_at(4, kThere, false));
  const auto view = finder.find(frame_at(5, kThere, false), window, calibration());
  ASSERT_TRUE(view);
  EXPECT_EQ(view->reference(), FrameId{3});
}

TEST(SurfaceFinder, WithoutDepthsThereIsNothing) {
  Frame blind = frame_at(2, kThere, false);
  blind.depth = nullptr;
  EXPECT_FALSE(SurfaceFinder(rig()).find(blind, window_of(false), calibration()));
  EXPECT_FALSE(SurfaceFinder(rig()).find(frame_at(2, kThere, false), FrameList{}, calibration()));
  const StereoRig pair = with_cameras(rig(), {rig().mounted(0), {rig().left(), {rig().T_BC0().q, Vec3(0, 0, 0)}}});
  EXPECT_FALSE(SurfaceFinder(pair).find(frame_at(2, kThere, false), window_of(false), calibration()));
}

}  // namespace surface_view_test
}  // namespace fbvins
