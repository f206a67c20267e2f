// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/opencv_lens.hpp"

#include <gtest/gtest.h>

#include "fbvins/camera/lens_numbers.hpp"

namespace fbvins {
namespace opencv_lens_test {

constexpr std::array<double, 4> kFocal{505.0, 505.2, 321.0, 243.5};
const std::vector<double> kRational{0.52, -2.44, 4e-4, -1e-4, 1.42, 0.40, -2.26, 1.35};

std::string model_of(const std::vector<double>& k) {
  const Result<Camera> camera = opencv_camera(kFocal, k, 640, 480);
  return camera ? camera->model_name() : camera.error().message;
}

TEST(OpencvLens, TheFewestCoefficientsThatSayTheSame) {
  EXPECT_EQ(model_of({}), "pinhole-radtan");
  EXPECT_EQ(model_of({-0.28, 0.07, 1e-4, 2e-5}), "pinhole-radtan");
  EXPECT_EQ(model_of({-0.28, 0.07, 1e-4, 2e-5, 0}), "pinhole-radtan");
  EXPECT_EQ(model_of({-0.28, 0.07, 1e-4, 2e-5, -0.02}), "pinhole-radtan5");
  EXPECT_EQ(model_of({-0.28, 0.07, 1e-4, 2e-5, -0.02, 0, 0, 0}), "pinhole-radtan5");
  EXPECT_EQ(model_of(kRational), "pinhole-rational");
  EXPECT_EQ(model_of(std::vector<double>(14, 0.0)), "pinhole-radtan");
  for (const std::size_t count : {1u, 3u, 6u, 7u, 9u, 13u, 15u})
    EXPECT_EQ(model_of(std::vector<double>(count, 1e-3)),
              "has " + std::to_string(count) + " numbers where 4, 5, 8, 12 or 14 are known");
}

TEST(OpencvLens, ThinPrismAndTiltAreRefusedWhereTheyMatter) {
  std::vector<double> k = kRational;
  k.resize(12, 0.0);
  k[8] = 2e-4, k[10] = -1e-4;  // 505 px * 2e-4 * 0.64 (the corner's r^2) = 0.06 px
  EXPECT_EQ(model_of(k), "pinhole-rational");
  k[8] = 2e-3;
  EXPECT_NE(model_of(k).find("its thin prism (s1 to s4) move pixels by up to 0.6"), std::string::npos) << model_of(k);
  k[8] = 0, k[10] = 0;
  k.resize(14, 0.0);
  k[12] = 1e-5;
  EXPECT_EQ(model_of(k), "pinhole-rational");
  k[12] = 5e-3;
  EXPECT_NE(model_of(k).find("tilt"), std::string::npos) << model_of(k);
}

TEST(OpencvLens, NamesOfOthersForTheSame) {
  for (const char* name : {"radtan", "radial-tangential", "RadTan", "plumb_bob", "rational_polynomial", "Brown Conrady"})
    EXPECT_EQ(distortion_kind(name), DistortionKind::brown) << name;
  for (const char* name : {"equidistant", "fisheye", "kannala_brandt", "KANNALA_BRANDT", "Kannala Brandt4", "kb4"})
    EXPECT_EQ(distortion_kind(name), DistortionKind::equidistant) << name;
  EXPECT_EQ(distortion_kind("none"), DistortionKind::none);
  for (const char* name : {"", "fov", "Inverse Brown Conrady", "ftheta"})
    EXPECT_EQ(distortion_kind(name), DistortionKind::unknown) << name;
}

TEST(OpencvLens, ARationalLensIsTheQuotientThatOpencvDefines) {
  const Camera camera = *opencv_camera(kFocal, kRational, 640, 480);
  // x = 0.3, y = -0.2: s = 0.13, N = 1 + 0.0676 - 0.041236 + 0.003119740, D = 1 + 0.052 - 0.038194 + 0.00296595.
  const double a = 1.02948374 / 1.01677195, x = 0.3, y = -0.2;
  const Vec2 pixel = *camera.project(Vec3(x, y, 1));
  EXPECT_NEAR(pixel.x(), 505.0 * (x * a + 2 * 4e-4 * x * y - 1e-4 * (0.13 + 2 * x * x)) + 321.0, 1e-6);
  EXPECT_NEAR(pixel.y(), 505.2 * (y * a + 4e-4 * (0.13 + 2 * y * y) - 2 * 1e-4 * x * y) + 243.5, 1e-6);
}

TEST(OpencvLens, BeyondAPoleThereIsNoRay) {
  const Camera camera = *opencv_camera(kFocal, {0, 0, 0, 0, 0, -1.0, 0, 0}, 640, 480);  // D = 1 - s
  EXPECT_TRUE(camera.project(Vec3(0.9, 0, 1)));
  EXPECT_FALSE(camera.project(Vec3(1.1, 0, 1)));
  EXPECT_LT(camera.max_normalised_radius(), 1.01);
}

TEST(OpencvLens, WhatIsWrittenIsReadBack) {
  for (const std::vector<double>& k :
       {std::vector<double>{-0.28, 0.07, 1e-4, 2e-5}, {-0.28, 0.07, 1e-4, 2e-5, -0.02}, kRational}) {
    const Camera camera = *opencv_camera(kFocal, k, 640, 480);
    const OpencvCoefficients written = opencv_coefficients(camera);
    EXPECT_EQ(opencv_camera(kFocal, written.values, 640, 480)->distortion(), camera.distortion());
    EXPECT_EQ(distortion_kind(written.ros_model), DistortionKind::brown);
    EXPECT_EQ(distortion_kind(kalibr_camera(camera).distortion), DistortionKind::brown);
    const auto same = lens_of(camera.model_name(), kFocal, camera.distortion());
    ASSERT_TRUE(same) << camera.model_name();
    EXPECT_EQ(same->index(), camera.model().index());
  }
}

}  // namespace opencv_lens_test
}  // namespace fbvins
