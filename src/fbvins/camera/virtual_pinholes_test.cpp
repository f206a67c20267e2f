// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/virtual_pinholes.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace virtual_pinholes_test {

/// Lenses of 200 to 220 degrees of each model that has them.
std::vector<Camera> wide_lenses() {
  return {{KannalaBrandt{150, 150, 256, 255, 0.02, -0.01, 0.003, 0}, 512, 512},
          {DoubleSphere{130, 131, 254.9, 256.9, -0.2, 0.6}, 512, 512},
          {ExtendedUnified{140, 139, 256, 250, 0.63, 1.04}, 512, 512},
          {UnifiedRadtan{300, 301, 250, 260, 1.5, 0.01, 0, 0.0005, -0.0003}, 512, 512}};
}

StereoRig rig_of(const Camera& left, const Camera& right) {
  StereoRig rig;
  rig.cameras.resize(2);
  rig.cameras[0].camera = left;
  rig.cameras[1].camera = right;
  rig.cameras[0].T_BC = Pose<B, C0>(Quat(0.5, -0.5, 0.5, -0.5), Vec3(0.1, 0, 0));
  rig.cameras[1].T_BC = Pose<B, C0>(Quat(0.5, -0.5, 0.5, -0.5), Vec3(0.1, -0.11, 0));
  return rig;
}

TEST(VirtualPinholes, RaysBehindTheLensComeBackFromTheirPixels) {
  Rng rng(1);
  for (const Camera& camera : wide_lenses()) {
    int backwards = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vec2 px(rng.uniform(0, 511), rng.uniform(0, 511));
      const auto ray = camera.ray(px);
      if (!ray) continue;
      backwards += ray->z() < 0;
      EXPECT_NEAR(ray->norm(), 1, 1e-12);
      const auto again = camera.pixel_of(3 * *ray);
      ASSERT_TRUE(again) << camera.model_name() << ' ' << px.transpose();
      EXPECT_LT((*again - px).norm(), 1e-8) << camera.model_name() << ' ' << px.transpose();
      const auto n = camera.undistort(px);
      if (n) {
        EXPECT_LT((ray->hnormalized() - *n).norm(), 1e-9 * (1 + n->squaredNorm()));
      }
    }
    EXPECT_GT(backwards, 20) << camera.model_name();
  }
}

TEST(VirtualPinholes, ATurnedCameraProjectsAndComesBackWithTheRightSlope) {
  Rng rng(2);
  for (const Camera& lens : wide_lenses()) {
    const Mat3 R = so3_exp(Vec3(0.3, 1.2, -0.2)).toRotationMatrix();
    const Camera camera = lens.turned(R);
    int seen = 0;
    for (int i = 0; i < 500; ++i) {
      const Vec3 p(rng.uniform(-1, 1), rng.uniform(-1, 1), 1);
      const auto px = camera.project(2 * p);
      if (!px) continue;
      ++seen;
      EXPECT_LT((*px - *lens.pixel_of(R * p)).norm(), 1e-9);
      const auto n = camera.undistort(*px);
      ASSERT_TRUE(n) << camera.model_name();
      EXPECT_LT((*n - p.head<2>()).norm(), 1e-8) << camera.model_name();
      Mat2 J;
      (void)camera.distort(p.head<2>(), &J);
      constexpr double kStep = 1e-6;
      for (int k = 0; k < 2; ++k) {
        const Vec2 d = kStep * Vec2::Unit(k);
        const Vec2 slope = (camera.distort(Vec2(p.head<2>() + d)) - camera.distort(Vec2(p.head<2>() - d))) / (2 * kStep);
        EXPECT_LT((J.col(k) - slope).norm(), 1e-3) << camera.model_name();
      }
    }
    EXPECT_GT(seen, 200) << camera.model_name();
  }
}

/// Each pixel with a ray is shown by one face at least, with an angle from its axis at which a plane still is good.
TEST(VirtualPinholes, TheFacesShowAllOfTheImage) {
  for (const Camera& camera : wide_lenses()) {
    const Pose<B, C0> T_BC(Quat(0.5, -0.5, 0.5, -0.5), Vec3(0.1, 0.2, 0.3));
    const std::vector<MountedCamera> faces = faces_of({camera, T_BC});
    ASSERT_EQ(faces.size(), 4U) << camera.model_name();
    int twice = 0, all = 0;
    for (int y = 0; y < 512; y += 3)
      for (int x = 0; x < 512; x += 3) {
        const Vec2 px(x, y);
        const auto ray = camera.ray(px);
        int shown = 0;
        for (const MountedCamera& face : faces) {
          if (!face.camera.inside(px)) continue;
          ++shown;
          const auto n = face.camera.undistort(px);
          ASSERT_TRUE(n);
          EXPECT_LT(n->norm(), std::tan(75 * kDegree));
          const Vec3 in_body = face.T_BC.q * n->homogeneous().normalized();
          EXPECT_LT((in_body - T_BC.q * *ray).norm(), 1e-8);
        }
        EXPECT_EQ(shown > 0, ray.has_value()) << camera.model_name() << ' ' << px.transpose();
        all += ray.has_value();
        twice += shown > 1;
      }
    EXPECT_LT(twice, 0.25 * all) << camera.model_name();
  }
}

TEST(VirtualPinholes, HideWhatTheLensMaskHides) {
  Camera camera = wide_lenses()[0];
  Image seen(512, 512, 255);
  ASSERT_TRUE(hide(seen, MaskCircle{256, 100, 50}));
  camera.set_mask(std::make_shared<const Mask>(seen));
  for (const MountedCamera& face : faces_of({camera, {}})) EXPECT_TRUE(face.camera.hidden({256, 100}, 0));
}

TEST(VirtualPinholes, ALensThatTheImageCutsOffAboveAndBelowHasNoFaceThere) {
  const Camera camera(KannalaBrandt{200, 200, 376, 80, 0, 0, 0, 0}, 752, 160);  // 215 degrees by 46
  ASSERT_TRUE(camera.sees_backwards());
  const std::vector<MountedCamera> faces = faces_of({camera, {}});
  ASSERT_EQ(faces.size(), 3U);
  for (const MountedCamera& face : faces) EXPECT_LT(std::abs((face.T_BC.q * Vec3::UnitZ()).y()), 0.1);
}

TEST(VirtualPinholes, KeepTheNumbersOfTheRigsCameras) {
  const Camera wide = wide_lenses()[0], narrow(PinholeRadtan{460, 460, 376, 240, 0, 0, 0, 0}, 752, 480);
  const StereoRig plain = rig_of(narrow, narrow), mixed = rig_of(wide, narrow), both = rig_of(wide, wide);
  EXPECT_FALSE(VirtualPinholes(plain).any());
  const VirtualPinholes faces(mixed);
  ASSERT_TRUE(faces.any());
  ASSERT_EQ(faces.rig().camera_count(), 5);
  EXPECT_EQ(faces.lens_of(0), 0);
  EXPECT_EQ(faces.lens_of(1), 1);
  for (int i = 2; i < 5; ++i) EXPECT_EQ(faces.lens_of(i), 0);
  EXPECT_EQ(faces.rig().T_BC1().p, mixed.T_BC1().p);
  EXPECT_EQ(faces.lenses_of(0b00010), 0b10);
  EXPECT_EQ(faces.lenses_of(0b01000), 0b01);
  EXPECT_EQ(VirtualPinholes(both).rig().camera_count(), 8);
  EXPECT_EQ(VirtualPinholes(both).lenses_of(0b11100000), 0b10);

  auto picture = std::make_shared<Image>(512, 512);
  for (int y = 0; y < 512; ++y)
    for (int x = 0; x < 512; ++x) picture->at(x, y) = static_cast<std::uint8_t>(3 * x + 7 * y);
  const std::shared_ptr<const Image> left = picture, right = std::make_shared<const Image>(752, 480);
  StereoFrame frame{Time{5}, {left, right}};
  frame.offsets.set(0, Duration{7});
  const StereoFrame spread = faces.spread(frame);
  EXPECT_EQ(spread.image(1), right);
  for (const int i : {0, 2, 3, 4}) {
    const Camera& face = faces.rig().camera(i);
    ASSERT_EQ(spread.image(i)->width(), face.width());
    ASSERT_EQ(spread.image(i)->height(), face.height());
    EXPECT_LT(face.width() * face.height(), 512 * 512 / 2);
    const auto x = static_cast<int>(faces.origin_px(i).x()), y = static_cast<int>(faces.origin_px(i).y());
    EXPECT_EQ(spread.image(i)->at(5, 9), picture->at(x + 5, y + 9));
    EXPECT_EQ(spread.offsets.of(i), Duration{7});
    // A direction of the face has the pixel of the lens.
    const Vec3 p = Vec3(0.1, -0.2, 1);
    const Vec3 in_lens = mixed.T_BC0().q.conjugate() * (faces.rig().T_BC(i).q * p);
    EXPECT_LT((*face.project(p) + faces.origin_px(i) - *wide.pixel_of(in_lens)).norm(), 1e-8);
  }
  frame.set_image(0, nullptr);
  EXPECT_EQ(faces.spread(frame).image(3), nullptr);
}

TEST(VirtualPinholes, KeepAllRowsOfARollingShutter) {
  StereoRig rig = rig_of(wide_lenses()[0], wide_lenses()[0]);
  rig.line_delay_s = 2e-5;
  const VirtualPinholes faces(rig);
  for (int i = 0; i < faces.rig().camera_count(); ++i) EXPECT_EQ(faces.rig().camera(i).height(), 512);
}

TEST(VirtualPinholes, OneLensIsSeveralCameras) {
  StereoRig rig = rig_of(wide_lenses()[1], {});
  const VirtualPinholes faces(with_one_camera(rig));
  ASSERT_EQ(faces.rig().camera_count(), 4);
  TrackedFrame frame;
  frame.features.resize(2);
  frame.features[1].lead = 3;
  frame.features[1].see(3, Observation{.pixel = Vec2(2, 3)});
  frame.cameras = {true, true, true, true};
  const TrackedFrame gathered = faces.gathered(frame);
  EXPECT_EQ(gathered.features[1].lead, 0);
  ASSERT_TRUE(gathered.features[1].left());
  EXPECT_EQ(gathered.features[1].left()->pixel, faces.origin_px(3) + Vec2(2, 3));
  EXPECT_EQ(gathered.cameras, std::vector<bool>{true});
}

}  // namespace virtual_pinholes_test
}  // namespace fbvins
