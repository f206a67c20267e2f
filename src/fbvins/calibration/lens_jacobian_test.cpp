// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/lens_jacobian.hpp"

#include <gtest/gtest.h>

#include "fbvins/calibration/simulated_board.hpp"
#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace lens_jacobian_test {

Vec3 random_direction(Rng& rng, double largest_rad) {
  const double azimuth = rng.uniform(0, 6.2831), off = rng.uniform(0.01, largest_rad), range_m = rng.uniform(0.2, 3);
  return range_m * Vec3(std::sin(off) * std::cos(azimuth), std::sin(off) * std::sin(azimuth), std::cos(off));
}

TEST(LensJacobian, ProjectsAsTheCameraDoes) {
  Rng rng(1);
  for (const Camera& camera : example_cameras())
    for (int i = 0; i < 200; ++i) {
      const Vec3 p = random_direction(rng, 0.6);
      const auto expected = camera.project(p), got = project_point(camera.model(), p);
      ASSERT_TRUE(expected && got) << camera.model_name();
      EXPECT_LT((*expected - *got).norm(), 1e-9) << camera.model_name();
    }
}

TEST(LensJacobian, DerivativesAreThoseOfFiniteDifferences) {
  Rng rng(2);
  for (const Camera& camera : example_cameras()) {
    const LensModel& lens = camera.model();
    for (int i = 0; i < 100; ++i) {
      const Vec3 p = random_direction(rng, camera.model_name().starts_with("pinhole-ra") ? 0.6 : 1.2);
      LensDerivatives d;
      ASSERT_TRUE(project_point(lens, p, &d)) << camera.model_name();
      const double h = 1e-6;
      for (int k = 0; k < 3; ++k) {
        const Vec3 step = h * Vec3::Unit(k);
        const Vec2 numeric = (*project_point(lens, p + step) - *project_point(lens, p - step)) / (2 * h);
        EXPECT_LT((numeric - d.point.col(k)).norm(), 1e-4 * (1 + d.point.norm())) << camera.model_name();
      }
      const std::vector<double> at = lens_parameters(lens);
      for (std::size_t k = 0; k < at.size(); ++k) {
        std::vector<double> more = at, less = at;
        more[k] += h, less[k] -= h;
        const Vec2 numeric =
            (*project_point(with_parameters(lens, more.data()), p) - *project_point(with_parameters(lens, less.data()), p)) /
            (2 * h);
        EXPECT_LT((numeric - d.parameters.col(static_cast<int>(k))).norm(), 1e-5 * (1 + d.parameters.norm()))
            << camera.model_name() << ' ' << lens_parameter_names(lens)[k];
      }
    }
  }
}

TEST(LensJacobian, ModelsOfWideLensesAlsoTakeRaysThatPointBackwards) {
  const Vec3 backwards(1, 0.2, -0.1);
  EXPECT_TRUE(project_point(KannalaBrandt{190, 190, 256, 256}, backwards));
  EXPECT_TRUE(project_point(DoubleSphere{158, 158, 256, 256, -0.17, 0.59}, backwards));
  EXPECT_TRUE(project_point(ExtendedUnified{190, 190, 256, 256, 0.63, 1.04}, backwards));
  EXPECT_FALSE(project_point(PinholeRadtan{400, 400, 256, 256}, backwards));
}

TEST(LensJacobian, ASmallStepMovesTheParametersByItself) {
  Rng rng(3);
  for (const Camera& camera : example_cameras()) {
    const std::vector<double> at = lens_parameters(camera.model());
    std::vector<double> step;
    for (const double value : at) step.push_back(1e-5 * std::max(0.1, std::abs(value)) * rng.normal());
    const std::vector<double> after = lens_parameters(moved_lens(camera.model(), step.data()));
    for (std::size_t k = 0; k < at.size(); ++k)
      EXPECT_NEAR(after[k] - at[k], step[k], 1e-8 * std::max(1.0, std::abs(at[k]))) << camera.model_name() << ' ' << k;
  }
}

TEST(LensJacobian, EveryModelHasANameAndAStart) {
  for (const std::string& name : lens_names()) {
    const auto lens = plain_lens(name, 300, {320, 240});
    ASSERT_TRUE(lens) << name;
    EXPECT_EQ(Camera(*lens, 640, 480).model_name(), name);
    EXPECT_EQ(lens_parameter_names(*lens).size(), lens_parameters(*lens).size());
    // A focal length is what it is near the axis.
    EXPECT_NEAR(project_point(*lens, Vec3(0.001, 0, 1))->x() - 320, 0.3, 1e-4) << name;
  }
  EXPECT_FALSE(plain_lens("fov", 300, {320, 240}));
}

}  // namespace lens_jacobian_test
}  // namespace fbvins
