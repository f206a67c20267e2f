// SPDX-License-Identifier: Apache-2.0
// A lens that is injected does what the same model does that is built in.
#include <gtest/gtest.h>

#include "fbvins/camera/camera.hpp"
#include "fbvins/camera/lens_projection.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace own_lens_test {

/// A double sphere, as somebody else would write it: by its functions of points and pixels alone.
class Sphere final : public Lens {
 public:
  explicit Sphere(const DoubleSphere& model) : model_(model), camera_(model, 512, 512) {}

  std::string name() const override { return "sphere"; }
  std::array<double, 4> intrinsics() const override {
    return {model_.fx / (1 + model_.xi), model_.fy / (1 + model_.xi), model_.cx, model_.cy};
  }
  std::optional<Vec2> project(const Vec3& p_C, Eigen::Matrix<double, 2, 3>* J_pixel_point) const override {
    LensDerivatives derivatives;
    const auto pixel = project_point(model_, p_C, &derivatives);
    if (J_pixel_point && pixel) *J_pixel_point = derivatives.point;
    return pixel;
  }
  std::optional<Vec3> ray(const Vec2& pixel) const override {
    const auto unit = camera_.ray(pixel);
    return unit ? std::optional<Vec3>(2.5 * *unit) : std::nullopt;
  }

 private:
  DoubleSphere model_;
  Camera camera_;
};

constexpr DoubleSphere kModel{158.3, 158.2, 254.9, 256.9, -0.172, 0.593};
const Camera kBuiltIn(kModel, 512, 512), kOwn(std::make_shared<const Sphere>(kModel), 512, 512);

TEST(OwnLens, HasItsNameAndItsPinhole) {
  EXPECT_EQ(kOwn.model_name(), "sphere");
  EXPECT_EQ(kOwn.intrinsics()[2], kBuiltIn.intrinsics()[2]);
  EXPECT_EQ(kOwn.intrinsics()[3], kBuiltIn.intrinsics()[3]);
  EXPECT_NEAR(kOwn.focal_px(), kBuiltIn.focal_px(), 1e-12 * kBuiltIn.focal_px());
  EXPECT_FALSE(kOwn.sees_backwards());
}

TEST(OwnLens, ProjectsAndComesBackAsTheModelThatIsBuiltIn) {
  Rng rng(3);
  for (int i = 0; i < 500; ++i) {
    const double azimuth = rng.uniform(0, 6.2831), off_axis = rng.uniform(0, 1.4);
    const Vec3 p(std::sin(off_axis) * std::cos(azimuth), std::sin(off_axis) * std::sin(azimuth), std::cos(off_axis));
    const auto wanted = kBuiltIn.project(p), pixel = kOwn.project(p);
    ASSERT_TRUE(wanted && pixel) << p.transpose();
    EXPECT_LT((*pixel - *wanted).norm(), 1e-9);
    Mat2 J_wanted, J;
    (void)kBuiltIn.distort(p.hnormalized(), &J_wanted);
    (void)kOwn.distort(p.hnormalized(), &J);
    EXPECT_LT((J - J_wanted).norm(), 1e-7 * J_wanted.norm());
    const auto back = kOwn.undistort(*pixel);
    ASSERT_TRUE(back);
    EXPECT_LT((*back - p.hnormalized()).norm(), 1e-9 * (1 + p.hnormalized().squaredNorm()));
    EXPECT_LT((*kOwn.ray(*pixel) - p).norm(), 1e-10);
    EXPECT_LT((*kOwn.pixel_of(p) - *pixel).norm(), 1e-9);
  }
}

TEST(OwnLens, TurnsAsOthersDo) {
  const Mat3 R = so3_exp(Vec3(0.2, -0.5, 0.1)).toRotationMatrix();
  const Camera wanted = kBuiltIn.turned(R), turned = kOwn.turned(R);
  for (const Vec3& p : {Vec3(0, 0, 1), Vec3(0.4, -0.3, 2), Vec3(-1, 0.5, 1.5)})
    EXPECT_LT((*turned.project(p) - *wanted.project(p)).norm(), 1e-9);
}

TEST(OwnLens, HasNoPixelBehindTheCameraAndNoRayOutsideOfItsModel) {
  EXPECT_FALSE(kOwn.project(Vec3(0, 0, -1)));
  EXPECT_FALSE(kOwn.ray(Vec2(5000, 5000)));
  EXPECT_FALSE(kOwn.undistort(Vec2(5000, 5000)));
}

}  // namespace own_lens_test
}  // namespace fbvins
